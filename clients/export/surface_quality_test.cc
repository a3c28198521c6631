#include "clients/export/surface_quality.h"

#include <gtest/gtest.h>

namespace skein::surface_quality_test {

SurfaceQuality Example() {
  SurfaceQuality quality;
  quality.num_photos = 7;
  quality.in_metres = true;
  quality.depths = {600, 150, 250};
  quality.expected_error = {0.0123456, 0.5};
  quality.completeness = 0.25;
  quality.ground_sampling_distance = 0.125;
  return quality;
}

TEST(SurfaceQuality, SharesAreOfAllDepths) {
  const nlohmann::json json = ToJson(Example());
  EXPECT_EQ(json["photos"], 7);
  EXPECT_EQ(json["unit"], "m");
  EXPECT_EQ(json["depths"], 1000);
  EXPECT_EQ(json["agreed"], 0.6);
  EXPECT_EQ(json["contradicted"], 0.15);
  EXPECT_EQ(json["alone"], 0.25);
  EXPECT_EQ(json["expected_error_p95"], 0.5);
  EXPECT_TRUE(json["mesh_voxel"].is_null());
}

TEST(SurfaceQuality, NoDepthsHaveNoShares) {
  const nlohmann::json json = ToJson(SurfaceQuality());
  EXPECT_EQ(json["depths"], 0);
  EXPECT_EQ(json["agreed"], 0.0);
  EXPECT_EQ(json["unit"], "model");
}

TEST(SurfaceQuality, TextsLeaveOutWhatWasNotMade) {
  SurfaceQuality quality = Example();
  EXPECT_EQ(TextsOf(quality).count("mesh_voxel"), 0U);
  EXPECT_EQ(TextsOf(quality).at("unit"), "m");
  EXPECT_EQ(TextsOf(quality).at("agreed"), "0.6");
  quality.mesh_voxel = 0.25;
  EXPECT_EQ(TextsOf(quality).at("mesh_voxel"), "0.25");
}

TEST(SurfaceQuality, ALineIsForAPerson) {
  EXPECT_EQ(LineOf(Example()),
            "60 % of 1000 depths agree with two other photos, 15 % are contradicted, 25 % stand "
            "alone; expected error 0.0123 m in the median, 0.5 m in the 95th percentile, a pixel "
            "0.125 m wide on the ground");
}

}  // namespace skein::surface_quality_test
