#include "relay/relay_guard.h"

#include <gtest/gtest.h>

#include "core/clock.h"

namespace skein {
namespace {

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

TEST_F(RelayGuardTest, KnowsAMemberByAnySignature) {
  MessageSeal viewer = Seal(Role::kViewer);
  EXPECT_TRUE(requires_.Check("SKEIN_HELLO", viewer.Seal("SKEIN_HELLO", {})).is_signed);
  EXPECT_FALSE(requires_.Check("SKEIN_HELLO", {}).is_signed);
  MessageSeal other = Seal(Role::kViewer, kOther);
  EXPECT_FALSE(requires_.Check("SKEIN_HELLO", other.Seal("SKEIN_HELLO", {})).is_signed);
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

}  // namespace
}  // namespace skein
