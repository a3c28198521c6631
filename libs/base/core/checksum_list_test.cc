#include "core/checksum_list.h"

#include <gtest/gtest.h>

#include <fstream>

#include "core/hash.h"
#include "testing/test_folder.h"

namespace skein::checksum_list_test {

class ChecksumListTest : public testing::Test {
 protected:
  void Write(const std::string& name, const std::string& text) {
    std::filesystem::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name) << text;
  }
  std::vector<std::string> Damaged() { return *CheckChecksumList(folder_.path(), "list"); }

  TestFolder folder_;
};

TEST_F(ChecksumListTest, NamesWhatDiffersAndWhatIsMissing) {
  Write("report", "one");
  Write("models/0/points", "two");
  Write("models/1/points", "");
  ASSERT_TRUE(WriteChecksumList(folder_.path(), "list", {"models", "report"}).ok());
  EXPECT_TRUE(Damaged().empty());
  Write("models/0/points", "tvo");
  std::filesystem::remove(folder_ / "report");
  EXPECT_EQ(Damaged(), (std::vector<std::string>{"models/0/points", "report"}));
}

TEST_F(ChecksumListTest, IsReadBySha256sum) {
  Write("report", "one");
  ASSERT_TRUE(WriteChecksumList(folder_.path(), "list", {"report"}).ok());
  const std::string command = "cd " + folder_.path().string() + " && sha256sum --quiet -c list";
  EXPECT_EQ(std::system(command.c_str()), 0);
}

TEST_F(ChecksumListTest, TellsNoListFromADamagedOne) {
  EXPECT_EQ(CheckChecksumList(folder_.path(), "list").code(), StatusCode::kNotFound);
  Write("list", "rubbish\n");
  EXPECT_EQ(CheckChecksumList(folder_.path(), "list").code(), StatusCode::kDataLoss);
}

// A list that was sent would tell whether a file has a content.
TEST_F(ChecksumListTest, ReadsNothingOutsideOfItsFolder) {
  TestFolder outside;
  std::ofstream(outside / "secret") << "secret";
  const std::string hash = HashBytes("secret", 6);
  std::filesystem::create_symlink(outside / "secret", folder_ / "link");
  Write("list", hash + "  " + (outside / "secret").string() + "\n" + hash + "  ../" +
                    outside.path().filename().string() + "/secret\n" + hash + "  link\n");
  EXPECT_EQ(Damaged().size(), 3u);
}

TEST_F(ChecksumListTest, DoesNotListWhatIsNotThere) {
  EXPECT_FALSE(WriteChecksumList(folder_.path(), "list", {"absent"}).ok());
}

}  // namespace skein::checksum_list_test
