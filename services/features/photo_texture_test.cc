#include "features/photo_texture.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

namespace skein::photo_texture_test {

constexpr int kAll = TextureFields::kColumns * TextureFields::kRows;

int Count(const TextureFields& fields, int from_column = 0, int to_column = 64) {
  int count = 0;
  for (int row = 0; row < TextureFields::kRows; ++row) {
    for (int column = from_column; column < to_column; ++column) count += fields.Has(column, row);
  }
  return count;
}

cv::Mat1b Noise(cv::Size size, double deviation) {
  cv::Mat1f values(size);
  cv::RNG(5).fill(values, cv::RNG::NORMAL, 128, deviation);
  return values;
}

TEST(PhotoTexture, ABareWallHasNoneThoughTheSensorHasNoise) {
  EXPECT_EQ(Count(FindTexture(Noise({1600, 1200}, 1.2))), 0);
}

TEST(PhotoTexture, IsWhereTheWallIsRough) {
  cv::Mat1b wall = Noise({1600, 1200}, 1.2);
  Noise({800, 1200}, 4).copyTo(wall(cv::Rect(800, 0, 800, 1200)));
  const TextureFields fields = FindTexture(wall);
  EXPECT_EQ(Count(fields, 0, 32), 0);
  EXPECT_EQ(Count(fields, 32, 64), kAll / 2);
}

TEST(PhotoTexture, AnEdgeIsTextureForWindowsOnIt) {
  cv::Mat1b wall(1200, 1600, uint8_t{120});
  wall(cv::Rect(0, 0, 1600, 610)) = 140;  // ends in the middle of row 24
  const TextureFields fields = FindTexture(wall);
  for (const int row : {23, 25}) EXPECT_FALSE(fields.Has(10, row)) << row;
  EXPECT_EQ(Count(fields), 0) << "most of a field of 25 pixels is bare";
  cv::Mat1b small;
  cv::resize(wall, small, {400, 300}, 0, 0, cv::INTER_AREA);
  EXPECT_TRUE(FindTexture(small).Has(10, 24)) << "a window is as large as a field";
}

TEST(PhotoTexture, SlowChangesOfLightAreNone) {
  cv::Mat1b wall(1200, 1600);
  for (int x = 0; x < wall.cols; ++x) wall.col(x) = static_cast<uint8_t>(60 + x / 16);
  EXPECT_EQ(Count(FindTexture(wall)), 0);
}

TEST(PhotoTexture, ColourPhotosOfAnySizeAreTaken) {
  cv::Mat colour;
  cv::cvtColor(Noise({3000, 2000}, 30), colour, cv::COLOR_GRAY2BGR);
  EXPECT_EQ(Count(FindTexture(colour)), kAll);
  EXPECT_EQ(Count(FindTexture(Noise({40, 30}, 30))), kAll) << "fewer pixels than fields";
  EXPECT_EQ(Count(FindTexture(Noise({6, 40}, 30))), 0) << "smaller than a window";
}

}  // namespace skein::photo_texture_test
