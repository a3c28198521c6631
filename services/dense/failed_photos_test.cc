#include "dense/failed_photos.h"

#include <gtest/gtest.h>

#include "testing/test_folder.h"

namespace skein::failed_photos_test {

const std::vector<Step> kDiedOn7 = {{7, "depth map"}};

TEST(FailedPhotos, ThirdDeathOnAPhotoLeavesItOut) {
  const TestFolder folder;
  EXPECT_TRUE(FailedPhotos(folder.path(), kDiedOn7).LeftOut().empty());
  EXPECT_TRUE(FailedPhotos(folder.path(), {{8, "depth map"}}).LeftOut().empty());
  EXPECT_TRUE(FailedPhotos(folder.path(), kDiedOn7).LeftOut().empty());
  EXPECT_EQ(FailedPhotos(folder.path(), kDiedOn7).LeftOut(), std::vector<uint32_t>{7});
  EXPECT_EQ(FailedPhotos(folder.path(), {}).LeftOut(), std::vector<uint32_t>{7});
}

TEST(FailedPhotos, ErrorsCountToo) {
  FailedPhotos failed("", kDiedOn7);
  EXPECT_FALSE(failed.Note(7));
  EXPECT_TRUE(failed.Note(7));
  EXPECT_FALSE(failed.Note(9));
}

}  // namespace skein::failed_photos_test
