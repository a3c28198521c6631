#include "auth/home_mark.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <string>

#include "auth/session_keys.h"
#include "auth/web_pass.h"

namespace skein::home_mark_test {

namespace fs = std::filesystem;

constexpr char kId[] = "0123456789abcdef";

// With a state folder of its own, as a user of one host has it.
class HomeMarkTest : public testing::Test {
 protected:
  HomeMarkTest() {
    char name[] = "/tmp/skein_home_mark_test_XXXXXX";
    folder_ = ::mkdtemp(name);
    const char* before = std::getenv("XDG_STATE_HOME");
    before_ = before == nullptr ? "" : before;
    UseHost("here");
  }
  ~HomeMarkTest() override {
    before_.empty() ? ::unsetenv("XDG_STATE_HOME") : ::setenv("XDG_STATE_HOME", before_.c_str(), 1);
    fs::remove_all(folder_);
  }

  void UseHost(const std::string& name) const {
    ::setenv("XDG_STATE_HOME", (folder_ / name).c_str(), 1);
  }
  std::string MakeKeys(const std::string& session) const {
    fs::create_directories(folder_ / session);
    const std::string keys = (folder_ / session / "keys").string();
    const auto access = OpenSessionKeys(keys, kId, Role::kIngest, "ingest");
    EXPECT_TRUE(access.ok()) << access.error();
    return keys;
  }

  fs::path folder_;
  std::string before_;
};

TEST_F(HomeMarkTest, OwnKeysAreTakenAlsoWhereTheFolderWasMovedOrRestored) {
  MakeKeys("session");
  fs::rename(folder_ / "session", folder_ / "moved");
  const std::string moved = (folder_ / "moved" / "keys").string();
  EXPECT_TRUE(CheckRootIsOwn(moved).ok());
  fs::copy(folder_ / "moved", folder_ / "restored", fs::copy_options::recursive);
  EXPECT_TRUE(
      OpenSessionKeys((folder_ / "restored" / "keys").string(), kId, Role::kIngest, "ingest").ok());
}

TEST_F(HomeMarkTest, KeysOfAnotherHostAreRefusedInEveryUse) {
  UseHost("elsewhere");
  const std::string keys = MakeKeys("sent");
  ASSERT_TRUE(IssueWebPass(keys, kId, {Role::kOperator, "mallory", 0}).ok());
  UseHost("here");
  const Status own = CheckRootIsOwn(keys);
  EXPECT_EQ(own.code, StatusCode::kFailedPrecondition);
  EXPECT_NE(own.error().find("skein clone"), std::string::npos);
  EXPECT_NE(own.error().find("--adopt"), std::string::npos);
  EXPECT_EQ(OpenSessionKeys(keys, kId, Role::kWeb, "web").code(), StatusCode::kFailedPrecondition);
  EXPECT_FALSE(IssueInvitation(keys, kId, Role::kAgent, "anna", 0).ok());
  EXPECT_FALSE(IssueWebPass(keys, kId, {Role::kViewer, "vera", 0}).ok());
  EXPECT_TRUE(CheckSessionKeys(keys, kId).empty()) << "they are whole all the same";
}

TEST_F(HomeMarkTest, AMarkIsOfOneRoot) {
  const std::string own = MakeKeys("own");
  UseHost("elsewhere");
  const std::string keys = MakeKeys("sent");
  UseHost("here");
  fs::copy_file(own + "/home", keys + "/home", fs::copy_options::overwrite_existing);
  EXPECT_FALSE(CheckRootIsOwn(keys).ok());
  fs::remove(keys + "/home");
  EXPECT_FALSE(CheckRootIsOwn(keys).ok());
}

TEST_F(HomeMarkTest, AMarkOfANoteIsOfItsUserPurposeAndText) {
  const auto mark = HomeMarkOf("run/lcm_url", "memq://");
  ASSERT_TRUE(mark.ok()) << mark.error();
  EXPECT_EQ(mark->size(), 64u);
  EXPECT_EQ(*mark, *HomeMarkOf("run/lcm_url", "memq://"));
  EXPECT_NE(*mark, *HomeMarkOf("run/lcm_url", "memq:///"));
  EXPECT_NE(*mark, *HomeMarkOf("run/web_public", "memq://"));
  UseHost("elsewhere");
  EXPECT_NE(*mark, *HomeMarkOf("run/lcm_url", "memq://"));
}

TEST_F(HomeMarkTest, TheSecretIsItsUsersAlone) {
  MakeKeys("session");
  const fs::perms secret = fs::status(folder_ / "here" / "skein" / "home.key").permissions();
  EXPECT_EQ(secret & (fs::perms::group_all | fs::perms::others_all), fs::perms::none);
}

TEST_F(HomeMarkTest, WithoutAStateFolderTheErrorSaysWhatToSet) {
  fs::create_directories(folder_);
  ASSERT_TRUE(fs::exists("/proc/version"));
  ::setenv("XDG_STATE_HOME", "/proc/version", 1);
  fs::create_directories(folder_ / "session");
  const auto access =
      OpenSessionKeys((folder_ / "session" / "keys").string(), kId, Role::kIngest, "ingest");
  ASSERT_FALSE(access.ok());
  EXPECT_NE(access.error().find("XDG_STATE_HOME"), std::string::npos) << access.error();
}

}  // namespace skein::home_mark_test
