#include "invite/qr_code.h"

#include <qrencode.h>

#include <memory>
#include <stdexcept>

namespace skein {
namespace {

constexpr int kQuietZone = 4;  // modules, as the standard has it

bool IsDark(const std::vector<std::string>& modules, int row, int column) {
  const int size = static_cast<int>(modules.size());
  return row >= 0 && column >= 0 && row < size && column < size && modules[row][column] == '1';
}

}  // namespace

std::vector<std::string> QrModules(const std::string& text) {
  const std::unique_ptr<QRcode, decltype(&QRcode_free)> code(
      QRcode_encodeString8bit(text.c_str(), 0, QR_ECLEVEL_L), QRcode_free);
  if (!code) throw std::runtime_error("the text does not fit into a QR code");
  std::vector<std::string> rows(code->width, std::string(code->width, '0'));
  for (int row = 0; row < code->width; ++row) {
    for (int column = 0; column < code->width; ++column) {
      if ((code->data[row * code->width + column] & 1) != 0) rows[row][column] = '1';
    }
  }
  return rows;
}

std::string QrCode(const std::string& text) {
  const std::vector<std::string> modules = QrModules(text);
  const int size = static_cast<int>(modules.size());
  std::string picture;
  for (int row = -kQuietZone; row < size + kQuietZone; row += 2) {
    for (int column = -kQuietZone; column < size + kQuietZone; ++column) {
      const bool upper = IsDark(modules, row, column), lower = IsDark(modules, row + 1, column);
      picture += upper ? (lower ? " " : "▄") : (lower ? "▀" : "█");
    }
    picture += "\n";
  }
  return picture;
}

}  // namespace skein
