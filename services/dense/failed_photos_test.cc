#include "dense/failed_photos.h"

#include <gtest/gtest.h>

#include <csignal>

#include "testing/test_folder.h"

namespace skein::failed_photos_test {

const std::vector<Step> kDiedOn7 = {{7, "depth map"}};

TEST(FailedPhotos, ThirdDeathOnAPhotoLeavesItOut) {
  const TestFolder folder;
  EXPECT_TRUE(FailedPhotos(folder.path(), kDiedOn7, SIGSEGV).LeftOut().empty());
  EXPECT_TRUE(FailedPhotos(folder.path(), {{8, "depth map"}}, SIGALRM).LeftOut().empty());
  EXPECT_TRUE(FailedPhotos(folder.path(), kDiedOn7, SIGSEGV).LeftOut().empty());
  EXPECT_EQ(FailedPhotos(folder.path(), kDiedOn7, SIGSEGV).LeftOut(), std::vector<uint32_t>{7});
  EXPECT_EQ(FailedPhotos(folder.path(), {}, 0).LeftOut(), std::vector<uint32_t>{7});
}

TEST(FailedPhotos, DeathsFromOutsideDoNotCount) {
  const TestFolder folder;
  for (int i = 0; i < 5; ++i) {
    EXPECT_TRUE(FailedPhotos(folder.path(), kDiedOn7, i % 2 == 0 ? SIGKILL : 0).LeftOut().empty());
  }
}

TEST(FailedPhotos, ErrorsCountToo) {
  FailedPhotos failed("", kDiedOn7, SIGABRT);
  EXPECT_FALSE(failed.Note(7));
  EXPECT_TRUE(failed.Note(7));
  EXPECT_FALSE(failed.Note(9));
}

}  // namespace skein::failed_photos_test
