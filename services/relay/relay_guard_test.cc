#include "relay/relay_guard.h"

#include <gtest/gtest.h>

#include "core/clock.h"

namespace skein::relay_guard_test {

constexpr char kSession[] = "0123456789abcdef";
constexpr char kOther[] = "fedcba9876543210";

class RelayGuardTest : public testing::Test {
 protected:
  MessageSeal Seal(Role role, const std::string& session = kSession) {
    return {
        {session, root_.public_key()}, IssueCredential(root_, session, role, "x", 0), {}, NowUs};
  }
  std::string WhyRefused(RelayGuard& guard, const std::string& channel, const Bytes& message) {
    const char* why = guard.Check(channel, message).why_refused;
    return why == nullptr ? "" : why;
  }

  const SigningKey root_ = SigningKey::Generate();
  const Bytes message_ = {1, 2, 3};
  RelayGuard requires_{Seal(Role::kViewer), false};
  RelayGuard warns_{Seal(Role::kViewer), true};
};

TEST_F(RelayGuardTest, ForwardsWhatARoleMaySay) {
  MessageSeal agent = Seal(Role::kAgent);
  for (RelayGuard* guard : {&requires_, &warns_}) {
    const auto offer = guard->Check("SKEIN_IMAGE_OFFER", agent.Seal("SKEIN_IMAGE_OFFER", message_));
    EXPECT_EQ(offer.why_refused, nullptr);
    EXPECT_TRUE(offer.is_signed);
    EXPECT_EQ(WhyRefused(*guard, "SKEIN_IMAGE", agent.Seal("SKEIN_IMAGE", message_)),
              "its role may not say so");
    EXPECT_EQ(WhyRefused(*guard, "SKEIN_COMMAND", agent.Seal("SKEIN_COMMAND", message_)),
              "its role may not say so");
  }
}

TEST_F(RelayGuardTest, KnowsAMemberByAHelloOfItsConnectionAlone) {
  const Bytes binding(32, 1), another(32, 2);
  MessageSeal viewer = Seal(Role::kViewer), other = Seal(Role::kViewer, kOther);
  const auto is_member = [&](const Bytes& hello) {
    return requires_.WhyNoMember(hello, binding) == nullptr;
  };
  const Bytes hello = viewer.Seal("SKEIN_HELLO", binding);
  EXPECT_TRUE(is_member(hello));
  EXPECT_FALSE(is_member(hello));  // it came before
  EXPECT_FALSE(is_member(viewer.Seal("SKEIN_HELLO", another)));
  EXPECT_FALSE(is_member(viewer.Seal("SKEIN_HELLO", {})));
  EXPECT_FALSE(is_member(viewer.Seal("SKEIN_HEARTBEAT", binding)));
  EXPECT_FALSE(is_member(other.Seal("SKEIN_HELLO", binding)));
  EXPECT_FALSE(is_member(binding));  // not signed
  EXPECT_FALSE(is_member({}));
  EXPECT_EQ(WhyRefused(requires_, "SKEIN_HELLO", viewer.Seal("SKEIN_HELLO", binding)),
            "its role may not say so");
}

TEST_F(RelayGuardTest, RefusesForgeriesAndRepetitions) {
  MessageSeal agent = Seal(Role::kAgent);
  Bytes sealed = agent.Seal("SKEIN_IMAGE_OFFER", message_);
  EXPECT_EQ(WhyRefused(requires_, "SKEIN_IMAGE_OFFER", sealed), "");
  EXPECT_EQ(WhyRefused(requires_, "SKEIN_IMAGE_OFFER", sealed), "it came before");
  sealed = agent.Seal("SKEIN_IMAGE_OFFER", message_);
  sealed[0] ^= 1;
  EXPECT_EQ(WhyRefused(requires_, "SKEIN_IMAGE_OFFER", sealed), "its signature does not fit");
}

TEST_F(RelayGuardTest, WhatIsUnsignedGoesByTheMode) {
  EXPECT_EQ(WhyRefused(requires_, "SKEIN_IMAGE_OFFER", message_), "it is not signed");
  EXPECT_EQ(WhyRefused(requires_, "CAMERA", message_), "it is not signed");
  EXPECT_EQ(WhyRefused(warns_, "SKEIN_IMAGE_OFFER", message_), "");
  EXPECT_EQ(WhyRefused(warns_, "SKEIN_IMAGE", message_), "nobody may say so unsigned");
  EXPECT_EQ(WhyRefused(warns_, "CAMERA", message_), "");
}

TEST_F(RelayGuardTest, AnotherSessionNeedsItsOwnRelayWhereSignaturesAreRequired) {
  MessageSeal other = Seal(Role::kIngest, kOther);
  const Bytes sealed = other.Seal("SKEIN_IMAGE", message_);
  EXPECT_EQ(WhyRefused(requires_, "SKEIN_IMAGE", sealed),
            "it is of another session, which needs a relay of its own");
  EXPECT_EQ(WhyRefused(warns_, "SKEIN_IMAGE", sealed), "");
  EXPECT_FALSE(warns_.Check("SKEIN_IMAGE", sealed).is_signed);
}

}  // namespace skein::relay_guard_test
