#include "auth/web_pass.h"

#include <gtest/gtest.h>

#include <stdexcept>

#include "auth/revocations.h"
#include "auth/session_keys.h"
#include "testing/test_folder.h"

namespace skein::web_pass_test {

constexpr char kSession[] = "0123456789abcdef";
constexpr int64_t kNowS = 1'800'000'000;

class WebPassTest : public testing::Test {
 protected:
  std::string Issue(const WebPass& pass) { return *IssueWebPass(dir_, kSession, pass); }

  TestFolder folder_;
  const std::string dir_ = (folder_ / "keys").string();
  const SessionTrust trust_ = OpenSessionKeys(dir_, kSession, Role::kWeb, "web")->trust;
};

TEST_F(WebPassTest, SaysWhoItIsFor) {
  const auto pass = OpenWebPass(Issue({Role::kAgent, "anna-phone", kNowS + 60}), trust_, kNowS);
  ASSERT_TRUE(pass.ok()) << pass.error();
  EXPECT_EQ(pass->role, Role::kAgent);
  EXPECT_EQ(pass->name, "anna-phone");
  EXPECT_EQ(pass->expires_s, kNowS + 60);
  EXPECT_TRUE(OpenWebPass(Issue({Role::kViewer, "v", 0}), trust_, kNowS).ok());
}

TEST_F(WebPassTest, EndsWhenItExpires) {
  const std::string text = Issue({Role::kAgent, "anna", kNowS + 60});
  EXPECT_TRUE(OpenWebPass(text, trust_, kNowS + 59).ok());
  const auto expired = OpenWebPass(text, trust_, kNowS + 60);
  EXPECT_FALSE(expired.ok());
  EXPECT_NE(expired.error().find("ask for another"), std::string::npos);
}

TEST_F(WebPassTest, IsIssuedToNobodyWhoWasRevoked) {
  ASSERT_TRUE(RevokeName(dir_, "anna").ok());
  EXPECT_NE(IssueWebPass(dir_, kSession, {Role::kAgent, "anna", 0}).error().find("was revoked"),
            std::string::npos);
}

TEST_F(WebPassTest, IsOfOneSession) {
  const std::string text = Issue({Role::kAgent, "anna", 0});
  EXPECT_FALSE(OpenWebPass(text, {"fedcba9876543210", trust_.root}, kNowS).ok());
  const TestFolder other;
  const std::string others =
      *IssueWebPass((other / "keys").string(), kSession, {Role::kAgent, "anna", 0});
  EXPECT_FALSE(OpenWebPass(others, trust_, kNowS).ok());
}

TEST_F(WebPassTest, EachChangedLetterIsRefused) {
  const std::string text = Issue({Role::kAgent, "anna", 0});
  for (size_t i = 0; i < text.size(); ++i) {
    std::string changed = text;
    changed[i] = changed[i] == 'A' ? 'B' : 'A';
    EXPECT_FALSE(OpenWebPass(changed, trust_, kNowS).ok()) << i;
    EXPECT_FALSE(OpenWebPass(text.substr(0, i), trust_, kNowS).ok()) << i;
  }
  EXPECT_FALSE(OpenWebPass(text + "A", trust_, kNowS).ok());
  EXPECT_FALSE(OpenWebPass(std::string(100'000, 'A'), trust_, kNowS).ok());
}

TEST_F(WebPassTest, OpensNoOtherRoles) {
  for (const Role role : {Role::kIngest, Role::kWorker, Role::kWeb}) {
    EXPECT_THROW(Issue({role, "x", 0}), std::invalid_argument);
  }
  EXPECT_THROW(Issue({Role::kAgent, "", 0}), std::invalid_argument);
}

}  // namespace skein::web_pass_test
