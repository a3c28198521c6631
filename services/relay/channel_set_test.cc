#include "relay/channel_set.h"

#include <gtest/gtest.h>

namespace skein::channel_set_test {

TEST(ChannelSet, TakesNamesPrefixesAndEverything) {
  ChannelSet channels;
  EXPECT_EQ(channels.Add("SKEIN_IMAGE"), nullptr);
  EXPECT_EQ(channels.Add("SKEIN_SUBMIT_.*"), nullptr);
  EXPECT_TRUE(channels.Matches("SKEIN_IMAGE"));
  EXPECT_FALSE(channels.Matches("SKEIN_IMAGE_OFFER"));
  EXPECT_TRUE(channels.Matches("SKEIN_SUBMIT_SEED"));
  EXPECT_FALSE(channels.Matches("X_SKEIN_SUBMIT_SEED"));
  channels.Remove("SKEIN_SUBMIT_.*");
  EXPECT_FALSE(channels.Matches("SKEIN_SUBMIT_SEED"));
  EXPECT_EQ(channels.Add(".*"), nullptr);
  EXPECT_TRUE(channels.Matches("anything/else"));
  EXPECT_TRUE(channels.Matches(""));
}

// 5.8 GB in regcomp, for 47 bytes of a nested repetition.
TEST(ChannelSet, RefusesEveryOtherRegularExpression) {
  ChannelSet channels;
  for (const char* pattern : {"((((((((((a{1,9}){1,9}){1,9}){1,9}){1,9}){1,9}))))))", "(", "A|B",
                              ".*_A", "A.B", "A+", "[AB]", "^A", "A$", "A\\", "A.*.*", "A?"}) {
    EXPECT_NE(channels.Add(pattern), nullptr) << pattern;
  }
  EXPECT_FALSE(channels.Matches("A"));
}

TEST(ChannelSet, HoldsNoMoreThanItsLimits) {
  ChannelSet channels;
  EXPECT_EQ(channels.Add(std::string(ChannelSet::kMaxBytes, 'x')), nullptr);
  EXPECT_NE(channels.Add(std::string(ChannelSet::kMaxBytes + 1, 'x')), nullptr);
  for (size_t i = 1; i < ChannelSet::kMaxNames; ++i) {
    ASSERT_EQ(channels.Add("C" + std::to_string(i)), nullptr);
  }
  for (size_t i = 0; i < ChannelSet::kMaxPrefixes; ++i) {
    ASSERT_EQ(channels.Add("P" + std::to_string(i) + ".*"), nullptr);
  }
  EXPECT_NE(channels.Add("ONE_MORE"), nullptr);
  EXPECT_NE(channels.Add("ONE_MORE.*"), nullptr);
  EXPECT_EQ(channels.Add("C1"), nullptr) << "it is there already";
  channels.Remove("C2");
  EXPECT_EQ(channels.Add("ONE_MORE"), nullptr);
}

TEST(ChannelSet, WhatIsAddedTwiceIsRemovedTwice) {
  ChannelSet channels;
  channels.Add("A");
  channels.Add("A");
  channels.Remove("A");
  EXPECT_TRUE(channels.Matches("A"));
  channels.Remove("A");
  EXPECT_FALSE(channels.Matches("A"));
  channels.Remove("A");
  EXPECT_EQ(channels.Add("A"), nullptr);
  EXPECT_TRUE(channels.Matches("A"));
}

}  // namespace skein::channel_set_test
