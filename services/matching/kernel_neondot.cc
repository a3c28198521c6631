#include "matching/kernel_neon_body.h"

namespace skein {
namespace {

// udot takes uint8 x uint8 and adds four products to a uint32.
struct Product {
  template <int kRows>
  static void Multiply(const uint8_t* rows, const uint8_t* panel, Tile<kRows>& ab) {
    for (int r = 0; r < kRows; ++r) {
      for (int v = 0; v < kVectors; ++v) ab[r][v] = vdupq_n_u32(0);
    }
    for (int k = 0; k < 128; k += 16) {
      uint8x16_t a[kRows];
      for (int r = 0; r < kRows; ++r) a[r] = vld1q_u8(rows + 128 * r + k);
      const uint8_t* b = panel + kNeonPanelColumns * k;
      AddFour<kRows, 0>(a, b, ab);
      AddFour<kRows, 1>(a, b, ab);
      AddFour<kRows, 2>(a, b, ab);
      AddFour<kRows, 3>(a, b, ab);
    }
  }

  static uint32_t Dot(const uint8_t* a, const uint8_t* b) {
    uint32x4_t sums = vdupq_n_u32(0);
    for (int k = 0; k < 128; k += 16) sums = vdotq_u32(sums, vld1q_u8(a + k), vld1q_u8(b + k));
    return vaddvq_u32(sums);
  }

 private:
  // Products of four of the sixteen dimensions in `a`, the kFour-th.
  template <int kRows, int kFour>
  static void AddFour(const uint8x16_t (&a)[kRows], const uint8_t* b, Tile<kRows>& ab) {
    for (int v = 0; v < kVectors; ++v) {
      const uint8x16_t columns = vld1q_u8(b + 4 * kNeonPanelColumns * kFour + 16 * v);
      for (int r = 0; r < kRows; ++r) {
        ab[r][v] = vdotq_laneq_u32(ab[r][v], columns, a[r], kFour);
      }
    }
  }
};

}  // namespace

void ProcessBlockNeonDot(const BlockTask& task) { ProcessBlock<Product>(task); }
void ProcessDotsNeonDot(const DotTask& task) { ProcessDots<Product>(task); }

}  // namespace skein
