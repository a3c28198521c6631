#include "matching/kernel_neon_body.h"

namespace skein {
namespace {

// umull takes uint8 x uint8 to uint16, umlal adds another product: four of 127^2 fit. uadalp adds
// pairs of these sums to a uint32.
struct Product {
  template <int kRows>
  static void Multiply(const uint8_t* rows, const uint8_t* panel, Tile<kRows>& ab) {
    constexpr int kSteps = 64;  // of two dimensions
    for (int r = 0; r < kRows; ++r) {
      for (int v = 0; v < kVectors; ++v) ab[r][v] = vdupq_n_u32(0);
    }
    for (int k = 0; k < kSteps; k += kFour) {
      uint8x16_t b[kVectors / 2][kFour];  // eight columns each
      for (int v = 0; v < kVectors / 2; ++v) {
        for (int n = 0; n < kFour; ++n) {
          b[v][n] = vld1q_u8(panel + 2 * kNeonPanelColumns * (k + n) + 16 * v);
        }
      }
      for (int r = 0; r < kRows; ++r) {
        uint8x16_t a[kFour];
        for (int n = 0; n < kFour; ++n) {
          uint16_t two;
          __builtin_memcpy(&two, rows + 128 * r + 2 * (k + n), 2);
          a[n] = vreinterpretq_u8_u16(vdupq_n_u16(two));
        }
        for (int v = 0; v < kVectors / 2; ++v) AddProducts(a, b[v], &ab[r][2 * v]);
      }
    }
  }

  static uint32_t Dot(const uint8_t* a, const uint8_t* b) {
    uint32x4_t sums[2] = {vdupq_n_u32(0), vdupq_n_u32(0)};
    for (int k = 0; k < 128; k += 16 * kFour) {
      uint8x16_t of_a[kFour], of_b[kFour];
      for (int n = 0; n < kFour; ++n) {
        of_a[n] = vld1q_u8(a + k + 16 * n);
        of_b[n] = vld1q_u8(b + k + 16 * n);
      }
      AddProducts(of_a, of_b, sums);
    }
    return vaddvq_u32(vaddq_u32(sums[0], sums[1]));
  }

 private:
  static constexpr int kFour = 4;

  static void AddProducts(const uint8x16_t (&a)[kFour], const uint8x16_t (&b)[kFour],
                          uint32x4_t* sums) {
    uint16x8_t low = vmull_u8(vget_low_u8(a[0]), vget_low_u8(b[0]));
    uint16x8_t high = vmull_high_u8(a[0], b[0]);
    for (int n = 1; n < kFour; ++n) {
      low = vmlal_u8(low, vget_low_u8(a[n]), vget_low_u8(b[n]));
      high = vmlal_high_u8(high, a[n], b[n]);
    }
    sums[0] = vpadalq_u16(sums[0], low);
    sums[1] = vpadalq_u16(sums[1], high);
  }
};

}  // namespace

void ProcessBlockNeon(const BlockTask& task) { ProcessBlock<Product>(task); }
void ProcessDotsNeon(const DotTask& task) { ProcessDots<Product>(task); }

}  // namespace skein
