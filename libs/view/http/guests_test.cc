#include "http/guests.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "auth/session_keys.h"
#include "testing/test_folder.h"

namespace skein::guests_test {

constexpr char kSession[] = "0123456789abcdef";
constexpr int64_t kNowS = 1'800'000'000;
constexpr int64_t kDayS = 86'400;

class GuestsTest : public testing::Test {
 protected:
  std::string PassOf(int64_t expires_s) const {
    return *IssueWebPass(keys_, kSession, {Role::kViewer, "anna", expires_s});
  }
  // What a browser that shows the pass is told to keep.
  std::string CookieFor(int64_t expires_s) const {
    const nlohmann::json body = {{"pass", PassOf(expires_s)}};
    const HttpResponse response = guests_.Enter(body.dump(), true, kNowS);
    for (const auto& [name, value] : response.fields) {
      if (name == "Set-Cookie") return value;
    }
    return "";
  }
  bool LivesFor(const std::string& cookie, int64_t seconds) const {
    return cookie.find("; Max-Age=" + std::to_string(seconds) + ";") != std::string::npos;
  }

  const TestFolder folder_;
  const std::string keys_ = (folder_ / "keys").string();
  const SessionTrust trust_ = OpenSessionKeys(keys_, kSession, Role::kWeb, "web")->trust;
  const Guests guests_{trust_, [](const std::string&) { return false; }};
};

TEST_F(GuestsTest, ACookieLivesAsLongAsItsPassAndThirtyDaysAtMost) {
  EXPECT_PRED2([this](const auto& c, int64_t s) { return LivesFor(c, s); }, CookieFor(kNowS + 60),
               60);
  for (const int64_t expires_s : {int64_t{0}, kNowS + 400 * kDayS}) {
    EXPECT_PRED2([this](const auto& c, int64_t s) { return LivesFor(c, s); }, CookieFor(expires_s),
                 30 * kDayS);
  }
  EXPECT_EQ(CookieFor(kNowS - 1), "") << "expired";
}

TEST_F(GuestsTest, ACookieIsForHttpsAloneAndNotForScripts) {
  const std::string cookie = CookieFor(0);
  for (const char* word : {"; HttpOnly", "; SameSite=Strict", "; Secure", "; Path=/"}) {
    EXPECT_NE(cookie.find(word), std::string::npos) << word;
  }
}

// The browser may keep it longer than told: the pass decides.
TEST_F(GuestsTest, AnExpiredPassCountsNoMoreWhateverTheCookieSays) {
  const std::string cookie = "skein_" + std::string(kSession) + "=" + PassOf(kNowS + 60);
  EXPECT_EQ(guests_.Find(cookie, "", kNowS).name, "anna");
  EXPECT_EQ(guests_.Find(cookie, "", kNowS).refusal, "");
  const Visitor late = guests_.Find(cookie, "", kNowS + 61);
  EXPECT_FALSE(late.role.has_value());
  EXPECT_NE(late.refusal.find("has expired"), std::string::npos);
}

TEST_F(GuestsTest, AProgramShowsItsPassAsABearerToken) {
  const std::string pass = PassOf(kNowS + 60);
  EXPECT_EQ(guests_.Find("", "Bearer " + pass, kNowS).name, "anna");
  EXPECT_EQ(guests_.Find("", "bearer " + pass, kNowS).name, "anna") << "RFC 9110, 11.1";
  EXPECT_FALSE(guests_.Find("", "Bearer " + pass, kNowS + 61).role.has_value());
  for (const std::string& other :
       {"Basic " + pass, pass, std::string("Bearer "), "Bearer" + pass}) {
    EXPECT_FALSE(guests_.Find("", other, kNowS).role.has_value()) << other;
  }
}

}  // namespace skein::guests_test
