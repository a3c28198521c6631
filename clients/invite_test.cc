#include "clients/invite.h"

#include <gtest/gtest.h>

#include <stdexcept>

namespace skein::invite_test {

TEST(Invite, APassForTheOwnPortStaysOnItsHost) {
  EXPECT_EQ(OwnViewOf("http://127.0.0.1:8470/"), "http://127.0.0.1:8470");
  EXPECT_EQ(OwnViewOf("http://localhost:8470"), "http://localhost:8470");
  EXPECT_EQ(OwnViewOf("http://[::1]:8470"), "http://[::1]:8470");
  for (const char* view :
       {"", "8470", "http://127.0.0.1:", "http://127.0.0.1", "http://192.168.0.1:8470",
        "http://127.0.0.1:8470@evil.example", "http://127.0.0.1:8470/#x",
        "http://localhost.evil.example:8470", "https://evil.example"}) {
    EXPECT_THROW(OwnViewOf(view), std::invalid_argument) << view;
  }
}

}  // namespace skein::invite_test
