#include "matching/kernel_neon_body.h"

namespace skein {
namespace {

// umull takes uint8 x uint8 to uint16, uadalp adds pairs of products to a uint32.
struct Product {
  template <int kRows>
  static void Multiply(const uint8_t* rows, const uint8_t* panel, Tile<kRows>& ab) {
    constexpr int kSteps = 64;  // of two dimensions
    for (int r = 0; r < kRows; ++r) {
      for (int v = 0; v < kVectors; ++v) ab[r][v] = vdupq_n_u32(0);
    }
    for (int k = 0; k < kSteps; ++k) {
      uint8x16_t b[kVectors / 2];  // eight columns each
      for (int v = 0; v < kVectors / 2; ++v) {
        b[v] = vld1q_u8(panel + 2 * kNeonPanelColumns * k + 16 * v);
      }
      for (int r = 0; r < kRows; ++r) {
        uint16_t two;
        __builtin_memcpy(&two, rows + 128 * r + 2 * k, 2);
        const uint8x16_t a = vreinterpretq_u8_u16(vdupq_n_u16(two));
        for (int v = 0; v < kVectors / 2; ++v) AddProducts(a, b[v], &ab[r][2 * v]);
      }
    }
  }

  static uint32_t Dot(const uint8_t* a, const uint8_t* b) {
    uint32x4_t sums[2] = {vdupq_n_u32(0), vdupq_n_u32(0)};
    for (int k = 0; k < 128; k += 16) AddProducts(vld1q_u8(a + k), vld1q_u8(b + k), sums);
    return vaddvq_u32(vaddq_u32(sums[0], sums[1]));
  }

 private:
  static void AddProducts(uint8x16_t a, uint8x16_t b, uint32x4_t* sums) {
    sums[0] = vpadalq_u16(sums[0], vmull_u8(vget_low_u8(a), vget_low_u8(b)));
    sums[1] = vpadalq_u16(sums[1], vmull_high_u8(a, b));
  }
};

}  // namespace

void ProcessBlockNeon(const BlockTask& task) { ProcessBlock<Product>(task); }
void ProcessDotsNeon(const DotTask& task) { ProcessDots<Product>(task); }

}  // namespace skein
