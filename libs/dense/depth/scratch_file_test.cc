#include "depth/scratch_file.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <stdexcept>

#include "testing/test_folder.h"

namespace skein::depth_test {
namespace {

// While it lives this process writes no file of more bytes, as on a full disk.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit{bytes, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FileSizeLimit() {
    setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }

 private:
  rlimit before_{};
  void (*const handler_)(int);
};

class ScratchFileTest : public testing::Test {
 protected:
  TestFolder folder_;
};

TEST_F(ScratchFileTest, KeepsPixelsOfAnyType) {
  const cv::Mat1f depth(3, 5, 2.5f);
  const cv::Mat3b colours = cv::Mat3b(7, 4, cv::Vec3b(1, 2, 3)).colRange(1, 3);  // not continuous
  const int64_t bytes = ScratchFile::BytesFor(3 * 5 * 4) + ScratchFile::BytesFor(7 * 2 * 3);
  const auto file = ScratchFile::Make(folder_.path(), bytes);
  ASSERT_TRUE(file.ok()) << file.error();
  const cv::Mat1f kept_depth = (*file)->Keep(depth);
  const cv::Mat3b kept_colours = (*file)->Keep(colours);
  EXPECT_EQ(cv::norm(kept_depth, depth, cv::NORM_INF), 0);
  EXPECT_EQ(cv::norm(kept_colours, colours, cv::NORM_INF), 0);
  EXPECT_NE(kept_depth.data, depth.data);
  EXPECT_THROW((*file)->Keep(depth), std::length_error);
}

TEST_F(ScratchFileTest, HasNoName) {
  const auto file = ScratchFile::Make(folder_.path(), 1000);
  ASSERT_TRUE(file.ok()) << file.error();
  EXPECT_TRUE(std::filesystem::is_empty(folder_.path()));
}

TEST_F(ScratchFileTest, NoPhotosTakeNoRoom) {
  EXPECT_TRUE(ScratchFile::Make(folder_.path(), 0).ok());
}

TEST_F(ScratchFileTest, AFullDiskIsToldWithWhatToDo) {
  const FileSizeLimit limit(100'000);
  const auto file = ScratchFile::Make(folder_.path(), 5'000'000);
  ASSERT_FALSE(file.ok());
  EXPECT_NE(file.error().find("cannot keep depth maps in " + folder_.path().string()),
            std::string::npos)
      << file.error();
  EXPECT_NE(file.error().find("free 6 MB there"), std::string::npos) << file.error();
  EXPECT_TRUE(std::filesystem::is_empty(folder_.path()));
}

TEST_F(ScratchFileTest, AFolderThatIsNotThereIsTold) {
  const auto file = ScratchFile::Make(folder_ / "none", 1000);
  EXPECT_EQ(file.code(), StatusCode::kNotFound) << file.error();
}

}  // namespace
}  // namespace skein::depth_test
