#include "features/extremum_refinement.h"

#include <gtest/gtest.h>

#include <vector>

namespace skein::extremum_refinement_test {

constexpr int kColumns = 11, kCentre = 5;
constexpr int kRows = 2 * kMaxRefinementSteps + 3;

// 20 - a (x - x0)^2 - b (y - y0)^2 - (s - s0)^2, relative to column kCentre, the middle row and
// layer 2.
class Peak {
 public:
  Peak(float x0, float y0, float s0, float a = 1, float b = 1) {
    for (int d = 0; d < kDogLevels; ++d) {
      for (int r = 0; r < kRows; ++r) {
        std::vector<float>& row = values_[d][r];
        for (int c = 0; c < kColumns; ++c) {
          const float x = c - kCentre - x0, y = r - kRows / 2 - y0, s = d - 2 - s0;
          row.push_back(20 - a * x * x - b * y * y - s * s);
        }
        dog_.rows[d][r] = row.data();
      }
    }
  }
  std::optional<RefinedExtremum> Find(double min_contrast = 1) const {
    return Refine(dog_, {kCentre, 2}, min_contrast, 10);
  }

 private:
  std::vector<float> values_[kDogLevels][kRows];
  DogRows dog_{};
};

TEST(Refine, FindsTheTopOfAQuadratic) {
  const auto found = Peak(0.3f, -0.2f, 0.1f).Find();
  ASSERT_TRUE(found);
  EXPECT_EQ(found->layer, 2);
  EXPECT_NEAR(found->dx + found->step.x, 0.3, 1e-5);
  EXPECT_NEAR(found->dy + found->step.y, -0.2, 1e-5);
  EXPECT_NEAR(found->step.s, 0.1, 1e-5);
  EXPECT_NEAR(found->contrast, 20, 1e-4);
}

TEST(Refine, MovesToTheNextPixelAndLayer) {
  const auto found = Peak(1.2f, -1.9f, 0.8f).Find();
  ASSERT_TRUE(found);
  EXPECT_EQ(found->dx, 1);
  EXPECT_EQ(found->dy, -2);
  EXPECT_EQ(found->layer, 3);
  EXPECT_NEAR(found->step.x, 0.2, 1e-5);
}

TEST(Refine, LeavesOutWhatIsFarLowOrOnAnEdge) {
  EXPECT_FALSE(Peak(2.7f, 0, 0).Find());
  EXPECT_FALSE(Peak(0, 0, 1.7f).Find());
  EXPECT_FALSE(Peak(0, 0, 0).Find(20.5));
  EXPECT_TRUE(Peak(0, 0, 0, 9).Find());
  EXPECT_FALSE(Peak(0, 0, 0, 11).Find());
}

}  // namespace skein::extremum_refinement_test
