#include "core/folder.h"

#include <gtest/gtest.h>

#include <fstream>

#include "testing/test_folder.h"

namespace skein::folder_test {

namespace fs = std::filesystem;

TEST(CreateFolders, MakesWhatIsMissing) {
  const TestFolder folder;
  EXPECT_TRUE(CreateFolders(folder / "a/b/c").ok());
  EXPECT_TRUE(fs::is_directory(folder / "a/b/c"));
  EXPECT_TRUE(CreateFolders(folder / "a/b/c").ok()) << "it is there";
  EXPECT_TRUE(CreateFolders(folder / "a/b/d/").ok());
  EXPECT_TRUE(fs::is_directory(folder / "a/b/d"));
}

TEST(CreateFolders, SaysWhatStandsInTheWay) {
  const TestFolder folder;
  std::ofstream(folder / "file") << "x";
  const Status status = CreateFolders(folder / "file/a");
  EXPECT_FALSE(status.ok());
  EXPECT_NE(status.error().find("file"), std::string::npos);
}

TEST(SyncFolder, FailsWhereThereIsNone) {
  const TestFolder folder;
  EXPECT_TRUE(SyncFolder(folder.path()).ok());
  EXPECT_TRUE(SyncFileSystem(folder.path()).ok());
  EXPECT_FALSE(SyncFolder(folder / "nowhere").ok());
}

}  // namespace skein::folder_test
