#include "clients/other_files.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "testing/test_folder.h"

namespace skein::other_files_test {

namespace fs = std::filesystem;

class OtherFilesTest : public testing::Test {
 protected:
  void Write(const std::string& name) const {
    fs::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name) << "x";
  }
  // Lines of a look, without the folder's name, each to its end.
  std::string Look(double now_s) {
    out_.str("");
    teller_.LookAgain(now_s);
    std::string said = out_.str();
    const std::string begin = "skein agent: not taken in " + folder_.path().string() + ": ";
    for (size_t at = 0; (at = said.find(begin)) != std::string::npos;) said.erase(at, begin.size());
    return said;
  }

  const TestFolder folder_;
  std::ostringstream out_;
  OtherFilesTeller teller_{folder_.path().string(), out_};
};

TEST_F(OtherFilesTest, WhatComesLaterIsToldOnce) {
  Write("a.jpg");
  EXPECT_EQ(Look(100), "");
  Write("b.heic");
  Write("._a.jpg");
  Write("@eaDir/a.jpg");
  Write("a_depth.png");
  EXPECT_EQ(Look(100 + kLookForOthersS),
            "1 .heic (JPEG, PNG and TIFF are)\n"
            "1 *_depth.png (depth maps or masks beside photos)\n"
            "1 ._*, 1 in @eaDir (hidden photos, thumbnails and trash)\n");
  EXPECT_EQ(Look(100 + 2 * kLookForOthersS), "");
  Write("c.heic");
  EXPECT_EQ(Look(100 + 3 * kLookForOthersS), "2 .heic (JPEG, PNG and TIFF are)\n");
}

TEST_F(OtherFilesTest, LooksNoMoreThanEveryTenSeconds) {
  EXPECT_EQ(Look(100), "");
  Write("b.heic");
  EXPECT_EQ(Look(101), "");
  EXPECT_NE(Look(100 + kLookForOthersS), "");
}

TEST_F(OtherFilesTest, AFolderThatIsGoneIsToldByItsWatch) {
  Write("b.heic");
  EXPECT_NE(Look(100), "");
  fs::remove_all(folder_.path());
  EXPECT_EQ(Look(200), "");
  Write("b.heic");
  EXPECT_EQ(Look(300), "") << "as it was told";
}

}  // namespace skein::other_files_test
