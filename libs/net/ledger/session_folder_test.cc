#include "ledger/session_folder.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>
#include <set>
#include <thread>
#include <vector>

#include "testing/test_folder.h"

namespace skein::session_folder_test {

TEST(Session, KeepsItsIdWhenOpenedAgain) {
  TestFolder folder;
  const auto first = OpenOrCreateSession(folder / "session");
  ASSERT_TRUE(first.ok()) << first.error();
  EXPECT_EQ(first->session_id.size(), 16u);
  EXPECT_EQ(OpenSession(folder / "session")->session_id, first->session_id);
  EXPECT_NE(OpenOrCreateSession(folder / "another")->session_id, first->session_id);
}

TEST(Session, GetsOneIdFromManyCreators) {
  TestFolder folder;
  std::vector<std::string> ids(8);
  std::vector<std::thread> creators;
  for (auto& id : ids) {
    creators.emplace_back([&] { id = OpenOrCreateSession(folder / "session")->session_id; });
  }
  for (auto& creator : creators) creator.join();
  EXPECT_EQ(std::set<std::string>(ids.begin(), ids.end()).size(), 1u);
}

TEST(Session, RefusesDamagedAndForeignFiles) {
  for (const std::string text :
       {"", "{", "[]", R"({"identifier":"other"})",
        R"({"identifier":"skein-session","version":99,"session_id":"0123456789abcdef"})",
        R"({"identifier":"skein-session","version":1,"session_id":"../"})"}) {
    TestFolder folder;
    std::ofstream(folder / "session.json") << text;
    const auto session = OpenOrCreateSession(folder.path());
    ASSERT_FALSE(session.ok()) << text;
    EXPECT_NE(session.error().find("session.json"), std::string::npos);
  }
}

TEST(Session, RefusesAFileThatIsLargeOrDeepOrNone) {
  TestFolder folder;
  std::ofstream(folder / "session.json") << std::string(5'000'000, '[');
  EXPECT_FALSE(OpenSession(folder.path()).ok());
  std::ofstream(folder / "session.json") << std::string(10'000, '[');
  EXPECT_FALSE(OpenSession(folder.path()).ok());
  std::filesystem::remove(folder / "session.json");
  ASSERT_EQ(mkfifo((folder / "session.json").c_str(), 0600), 0);
  EXPECT_FALSE(OpenOrCreateSession(folder.path()).ok()) << "at once";
  std::filesystem::remove(folder / "session.json");
  const auto other = OpenOrCreateSession(folder / "other");
  std::filesystem::create_symlink(folder / "other" / "session.json", folder / "session.json");
  const auto linked = OpenSession(folder.path());
  ASSERT_FALSE(linked.ok());
  EXPECT_NE(linked.error().find("symbolic link"), std::string::npos);
}

TEST(Session, MustExistToBeOpened) {
  TestFolder folder;
  EXPECT_FALSE(OpenSession(folder / "nothing").ok());
}

}  // namespace skein::session_folder_test
