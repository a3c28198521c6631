#include "clients/launched.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "core/file.h"
#include "testing/test_folder.h"

namespace skein::launched_test {

namespace fs = std::filesystem;

constexpr char kUrl[] = "tcpqs://203.0.113.7:7700";
const std::vector<std::string> kAddresses = {"https://203.0.113.7:8471", "http://203.0.113.7:8472"};

// With a state folder of its own, as a user of one host has it.
class LaunchedTest : public testing::Test {
 protected:
  LaunchedTest() {
    const char* before = std::getenv("XDG_STATE_HOME");
    before_ = before == nullptr ? "" : before;
    UseHost("here");
    fs::create_directories(paths_.LaunchedUrl().parent_path());
  }
  ~LaunchedTest() override {
    before_.empty() ? ::unsetenv("XDG_STATE_HOME") : ::setenv("XDG_STATE_HOME", before_.c_str(), 1);
  }

  void UseHost(const std::string& name) const {
    ::setenv("XDG_STATE_HOME", (folder_ / name).c_str(), 1);
  }
  static std::string Content(const fs::path& file) {
    std::ifstream in(file);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  static void Write(const fs::path& file, const std::string& text) {
    EXPECT_TRUE(WriteFileAtomic(file.string(), text.data(), text.size()).ok());
  }

  TestFolder folder_;
  const SessionPaths paths_{folder_ / "session"};
  std::string before_;
};

TEST_F(LaunchedTest, OwnNotesAreFollowedAlsoWhereTheFolderWasMoved) {
  ASSERT_TRUE(NoteLaunchedUrl(paths_, kUrl).ok());
  ASSERT_TRUE(NoteBrowserAddresses(paths_, kAddresses).ok());
  EXPECT_EQ(*LaunchedUrl(paths_), kUrl);
  EXPECT_EQ(*BrowserAddresses(paths_), kAddresses);
  fs::rename(paths_.root, folder_ / "moved");
  EXPECT_EQ(*LaunchedUrl(SessionPaths{folder_ / "moved"}), kUrl);
}

TEST_F(LaunchedTest, AFolderThatWasNeverLaunchedLeadsNowhere) {
  EXPECT_EQ(*LaunchedUrl(paths_), "");
  EXPECT_TRUE(BrowserAddresses(paths_)->empty());
  ASSERT_TRUE(NoteLaunchedUrl(paths_, "").ok());
  EXPECT_EQ(*LaunchedUrl(paths_), "");
}

TEST_F(LaunchedTest, NotesOfAnotherHostLeadToNoOtherHost) {
  UseHost("elsewhere");
  ASSERT_TRUE(NoteLaunchedUrl(paths_, kUrl).ok());
  ASSERT_TRUE(NoteBrowserAddresses(paths_, kAddresses).ok());
  UseHost("here");
  const auto url = LaunchedUrl(paths_);
  EXPECT_EQ(url.code(), StatusCode::kFailedPrecondition);
  EXPECT_NE(url.error().find("skein clone"), std::string::npos) << url.error();
  EXPECT_NE(url.error().find("--lcm-url"), std::string::npos) << url.error();
  const auto addresses = BrowserAddresses(paths_);
  EXPECT_EQ(addresses.code(), StatusCode::kFailedPrecondition);
  EXPECT_NE(addresses.error().find("--web-public"), std::string::npos) << addresses.error();
}

TEST_F(LaunchedTest, ANoteThatWasChangedLeadsToNoOtherHost) {
  ASSERT_TRUE(NoteLaunchedUrl(paths_, kUrl).ok());
  ASSERT_TRUE(NoteBrowserAddresses(paths_, kAddresses).ok());
  const std::string note = Content(paths_.LaunchedUrl());
  std::string other = note;
  other.replace(other.find("203"), 3, "198");
  for (const std::string& text : {other, "tcpq://203.0.113.9:1\n" + note, note + note,
                                  std::string(kUrl), Content(paths_.BrowserAddresses())}) {
    Write(paths_.LaunchedUrl(), text);
    EXPECT_FALSE(LaunchedUrl(paths_).ok()) << text;
  }
  Write(paths_.BrowserAddresses(), note);
  EXPECT_FALSE(BrowserAddresses(paths_).ok()) << "the mark of the other note";
}

TEST_F(LaunchedTest, AUrlOfThisHostNeedsNoMark) {
  for (const char* url : {"tcpq://127.0.0.1:7700", "udpm://239.255.76.67:7667?ttl=0", "memq://"}) {
    Write(paths_.LaunchedUrl(), std::string(url) + "\n");
    EXPECT_EQ(*LaunchedUrl(paths_), url);
  }
  Write(paths_.BrowserAddresses(), "https://127.0.0.1:8471\n");
  EXPECT_FALSE(BrowserAddresses(paths_).ok()) << "a pass is handed out to nobody";
}

TEST_F(LaunchedTest, ALinkAndNonsenseAreNoNotes) {
  Write(paths_.LaunchedUrl(), "\033[2Jnonsense\n");
  const auto nonsense = LaunchedUrl(paths_);
  EXPECT_EQ(nonsense.code(), StatusCode::kDataLoss);
  EXPECT_EQ(nonsense.error().find('\033'), std::string::npos);
  Write(folder_ / "outside", std::string(kUrl) + "\n");
  fs::remove(paths_.LaunchedUrl());
  fs::create_symlink(folder_ / "outside", paths_.LaunchedUrl());
  EXPECT_EQ(*LaunchedUrl(paths_), "");
}

}  // namespace skein::launched_test
