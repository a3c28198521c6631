#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace skein {

// Fields of a photo, as stored, in which dense matching by windows finds texture: a bit for each of
// 64 x 48, row by row, the first one in the lowest bit. Any bits are valid.
struct TextureFields {
  static constexpr int kColumns = 64, kRows = 48;

  std::array<uint8_t, kColumns * kRows / 8> bits{};

  bool Has(int column, int row) const { return (bits[Byte(column, row)] & Bit(column)) != 0; }
  void Set(int column, int row) { bits[Byte(column, row)] |= Bit(column); }

 private:
  static size_t Byte(int column, int row) {
    return static_cast<size_t>(row * kColumns + column) / 8;
  }
  static uint8_t Bit(int column) { return static_cast<uint8_t>(1 << column % 8); }
};

}  // namespace skein
