#include "core/file.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <thread>
#include <vector>

#include "core/folder.h"

namespace skein::file_test {

class FileTest : public testing::Test {
 protected:
  FileTest() {
    char name[] = "/tmp/skein_file_test_XXXXXX";
    folder_ = ::mkdtemp(name);
  }
  ~FileTest() override { std::filesystem::remove_all(folder_); }
  std::string Path(const std::string& name) const { return folder_ + "/" + name; }
  size_t NumFiles() const {
    return std::distance(std::filesystem::directory_iterator(folder_),
                         std::filesystem::directory_iterator());
  }

  std::string folder_;
};

TEST_F(FileTest, ReadsBackWhatWasWritten) {
  ASSERT_TRUE(WriteFileAtomic(Path("a"), Bytes{1, 2, 3}).ok());
  ASSERT_TRUE(WriteFileAtomic(Path("a"), Bytes{4}).ok());
  EXPECT_EQ(*ReadFile(Path("a")), Bytes{4});
  EXPECT_EQ(NumFiles(), 1u);
}

TEST_F(FileTest, KeepsEmptyFiles) {
  ASSERT_TRUE(WriteFileAtomic(Path("empty"), Bytes{}).ok());
  const Result<Bytes> bytes = ReadFile(Path("empty"));
  ASSERT_TRUE(bytes.ok());
  EXPECT_TRUE(bytes->empty());
}

TEST_F(FileTest, SaysWhatIsMissing) {
  const Result<Bytes> missing = ReadFile(Path("missing"));
  EXPECT_EQ(missing.code(), StatusCode::kNotFound);
  EXPECT_NE(missing.error().find("missing"), std::string::npos);
  EXPECT_FALSE(ReadFile(folder_).ok());
  EXPECT_FALSE(WriteFileAtomic(Path("no/folder"), Bytes{1}).ok());
  EXPECT_EQ(NumFiles(), 0u);
}

TEST_F(FileTest, LeavesNoTemporaryFileWhenTheNameIsTaken) {
  std::filesystem::create_directories(Path("taken/inside"));
  EXPECT_FALSE(WriteFileAtomic(Path("taken"), Bytes{1}).ok());
  EXPECT_EQ(NumFiles(), 1u);
}

TEST_F(FileTest, ConcurrentWritersLeaveOneWholeFile) {
  std::vector<std::thread> writers;
  for (uint8_t i = 0; i < 4; ++i) {
    writers.emplace_back([this, i] {
      for (int n = 0; n < 10; ++n) {
        EXPECT_TRUE(WriteFileAtomic(Path("shared"), Bytes(10000 + i, i)).ok());
      }
    });
  }
  for (std::thread& writer : writers) writer.join();
  const Result<Bytes> bytes = ReadFile(Path("shared"));
  ASSERT_TRUE(bytes.ok());
  EXPECT_EQ(*bytes, Bytes(10000 + bytes->at(0), bytes->at(0)));
  EXPECT_EQ(NumFiles(), 1u);
}

TEST_F(FileTest, FindsTheFilesUnderAFolder) {
  std::filesystem::create_directories(Path("a/b"));
  ASSERT_TRUE(WriteFileAtomic(Path("z"), Bytes{1}).ok());
  ASSERT_TRUE(WriteFileAtomic(Path("a/b/y"), Bytes{1}).ok());
  std::filesystem::create_directory_symlink(folder_, Path("a/loop"));
  EXPECT_EQ(FilesUnder(folder_), (std::vector<std::filesystem::path>{Path("a/b/y"), Path("z")}));
  EXPECT_TRUE(FilesUnder(Path("absent")).empty());
}

}  // namespace skein::file_test
