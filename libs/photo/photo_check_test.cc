#include "photo/photo_check.h"

#include <gtest/gtest.h>

#include <cmath>

namespace skein {
namespace {

TEST(FocalPrior, PrefersExifThenTheOfferThenTheSize) {
  CheckedPhoto photo;
  photo.header = {PhotoFormat::kJpeg, 1000, 500, 3, 8};
  EXPECT_EQ(ChooseFocal(photo, 0).focal_px, 1200);
  EXPECT_EQ(ChooseFocal(photo, 900).focal_px, 900);
  EXPECT_EQ(ChooseFocal(photo, std::nan("")).focal_px, 1200);
  EXPECT_EQ(ChooseFocal(photo, -1e300).focal_px, 1200);
  photo.exif.focal_px = 800;
  EXPECT_EQ(ChooseFocal(photo, 900).focal_px, 800);
  EXPECT_TRUE(ChooseFocal(photo, 900).from_exif);
}

TEST(CameraKey, IsSharedByPhotosOfOneBodySizeAndZoom) {
  CheckedPhoto photo;
  photo.header = {PhotoFormat::kJpeg, 1000, 500, 3, 8};
  const std::string key = CameraKey("alice", photo, {1200, false});
  EXPECT_EQ(CameraKey("alice", photo, {1200.2, false}), key);
  EXPECT_NE(CameraKey("bob", photo, {1200, false}), key);
  EXPECT_NE(CameraKey("alice", photo, {2400, false}), key);
  photo.header.height_px = 501;
  EXPECT_NE(CameraKey("alice", photo, {1200, false}), key);
}

}  // namespace
}  // namespace skein
