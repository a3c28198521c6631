#include "photo/heif.h"

#include <algorithm>
#include <array>
#include <cstring>

namespace skein {
namespace {

constexpr size_t kBrandBytes = 4;
constexpr size_t kFirstCompatible = 16;  // behind size, type, major brand and its version

// mif1 and msf1 say that it is of the format, not how its pixels are coded.
constexpr std::array<const char*, 10> kHeicBrands = {"heic", "heix", "heim", "heis", "hevc",
                                                     "hevx", "hevm", "hevs", "mif1", "msf1"};
constexpr std::array<const char*, 2> kAvifBrands = {"avif", "avis"};

template <size_t N>
bool IsOneOf(const std::array<const char*, N>& brands, const uint8_t* brand) {
  return std::any_of(brands.begin(), brands.end(),
                     [&](const char* one) { return std::memcmp(one, brand, kBrandBytes) == 0; });
}

}  // namespace

const char* HeifName(ByteView file) {
  if (file.size() < kFirstCompatible || std::memcmp(file.data() + 4, "ftyp", kBrandBytes) != 0) {
    return nullptr;
  }
  const size_t box_bytes =
      size_t{file[0]} << 24 | size_t{file[1]} << 16 | size_t{file[2]} << 8 | size_t{file[3]};
  const size_t end = std::min({box_bytes, file.size(), kHeifHeadBytes});
  bool is_heic = IsOneOf(kHeicBrands, file.data() + 8);
  bool is_avif = IsOneOf(kAvifBrands, file.data() + 8);
  for (size_t at = kFirstCompatible; at + kBrandBytes <= end; at += kBrandBytes) {
    is_heic = is_heic || IsOneOf(kHeicBrands, file.data() + at);
    is_avif = is_avif || IsOneOf(kAvifBrands, file.data() + at);
  }
  if (is_avif) return "AVIF";
  return is_heic ? "HEIC" : nullptr;
}

}  // namespace skein
