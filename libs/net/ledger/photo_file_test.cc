#include "ledger/photo_file.h"

#include <gtest/gtest.h>

#include "core/file.h"
#include "core/folder.h"
#include "testing/test_folder.h"

namespace skein::photo_file_test {

TEST(StorePhoto, KeepsTheBytesUnderBothNames) {
  TestFolder folder;
  const SessionPaths paths{folder.path()};
  const Bytes first = {1, 2, 3}, second = {4, 5};
  ASSERT_TRUE(StorePhoto(paths, "a", "walk/1.jpg", first).ok());
  ASSERT_TRUE(StorePhoto(paths, "a", "walk/1.jpg", second).ok());
  EXPECT_EQ(*ReadFile(paths.Image("a", "walk/1.jpg").string()), second);
  EXPECT_EQ(FilesUnder(paths.Images()).size(), 1u);
  EXPECT_EQ(FilesUnder(paths.Blobs()).size(), 2u);
}

TEST(StorePhoto, RefusesNamesThatLeadOutOfTheFolder) {
  TestFolder folder;
  const SessionPaths paths{folder / "session"};
  using Name = std::pair<std::string, std::string>;
  for (const auto& [agent, name] :
       {Name{"a", "../1.jpg"}, Name{"..", "1.jpg"}, Name{"a/b", "1.jpg"}, Name{"a", "/tmp/1.jpg"},
        Name{"/tmp", "1.jpg"}, Name{"a", "b/../../1.jpg"}, Name{"a", ""}, Name{"", "1.jpg"},
        Name{"a", "b/"}, Name{"a", "."}}) {
    EXPECT_FALSE(StorePhoto(paths, agent, name, {1}).ok()) << agent << " " << name;
  }
  EXPECT_TRUE(FilesUnder(folder.path()).empty());
}

}  // namespace skein::photo_file_test
