#include "core/hash.h"

#include <gtest/gtest.h>

namespace skein::hash_test {

// FIPS 180-2 examples.
constexpr char kEmpty[] = "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855";
constexpr char kAbc[] = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";

TEST(Hash, MatchesThePublishedExamples) {
  EXPECT_EQ(HashBytes("", 0), kEmpty);
  EXPECT_EQ(HashBytes("abc", 3), kAbc);
}

TEST(Hash, InPiecesIsTheSameAndFinishStartsAnew) {
  Hasher hasher;
  hasher.Update("a", 1);
  hasher.Update("bc", 2);
  EXPECT_EQ(hasher.Finish(), kAbc);
  EXPECT_EQ(hasher.Finish(), kEmpty);
}

TEST(Hash, TellsBlobIdsFromOtherText) {
  EXPECT_TRUE(IsBlobId(kAbc));
  EXPECT_FALSE(IsBlobId(""));
  EXPECT_FALSE(IsBlobId(std::string(64, 'G')));
  EXPECT_FALSE(IsBlobId(std::string(64, 'A')));
  EXPECT_FALSE(IsBlobId(std::string(63, 'a')));
  EXPECT_FALSE(IsBlobId("../" + std::string(61, 'a')));
}

}  // namespace skein::hash_test
