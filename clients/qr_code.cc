#include "clients/qr_code.h"

#include <qrencode.h>

#include <memory>
#include <stdexcept>

namespace skein {
namespace {

constexpr int kQuietZone = 4;  // modules, as the standard has it

}  // namespace

std::string QrCode(const std::string& text) {
  const std::unique_ptr<QRcode, decltype(&QRcode_free)> code(
      QRcode_encodeString8bit(text.c_str(), 0, QR_ECLEVEL_L), QRcode_free);
  if (!code) throw std::runtime_error("the text does not fit into a QR code");
  const auto is_light = [&](int row, int column) {
    if (row < 0 || column < 0 || row >= code->width || column >= code->width) return true;
    return (code->data[row * code->width + column] & 1) == 0;
  };
  std::string picture;
  for (int row = -kQuietZone; row < code->width + kQuietZone; row += 2) {
    for (int column = -kQuietZone; column < code->width + kQuietZone; ++column) {
      const bool upper = is_light(row, column), lower = is_light(row + 1, column);
      picture += upper ? (lower ? "█" : "▀") : (lower ? "▄" : " ");
    }
    picture += "\n";
  }
  return picture;
}

}  // namespace skein
