#include "transport/type_layout.h"

#include <gtest/gtest.h>

#include "core/bytes.h"
#include "skein/candidates_t.hpp"
#include "skein/command_t.hpp"
#include "skein/image_t.hpp"
#include "skein/matches_t.hpp"
#include "skein/merge_t.hpp"
#include "skein/shared_request_t.hpp"
#include "skein/work_request_t.hpp"
#include "transport/decode.h"

namespace skein::type_layout_test {

template <class T>
Bytes Encode(const T& message) {
  Bytes bytes(message.getEncodedSize());
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

// One of each: numbers, strings, arrays of fixed and of variable length, values within values.
matches_t Matches() {
  matches_t message{};
  message.header.session_id = "session";
  message.header.fact_id = "matches/2";
  message.num_pairs = 3;
  message.pairs.resize(3);
  message.pairs_blob = "blob";
  return message;
}
merge_t Merge() {
  merge_t message{};
  message.header.author = "merger";
  message.target_from_source_scale = 2;
  message.reason = "none";
  return message;
}
image_t Image() {
  image_t message{};
  message.num_camera_params = 4;
  message.camera_params = {1, 2, 3, 4};
  return message;
}
work_request_t WorkRequest() {
  work_request_t message{};
  message.worker = "worker";
  message.num_held = 2;
  message.held = {1, 2};
  return message;
}
candidates_t Candidates() {
  candidates_t message{};
  message.num_candidates = 2;
  message.other_ids = {1, 2};
  message.distances = {0, 1};
  return message;
}
command_t Command() {
  command_t message{};
  message.verb = "finish";
  return message;
}

template <class T>
class Decode : public testing::Test {};
using Types = testing::Types<matches_t, merge_t, image_t, work_request_t, candidates_t, command_t>;
TYPED_TEST_SUITE(Decode, Types);

template <class T>
T Example() {
  if constexpr (std::is_same_v<T, matches_t>) return Matches();
  if constexpr (std::is_same_v<T, merge_t>) return Merge();
  if constexpr (std::is_same_v<T, image_t>) return Image();
  if constexpr (std::is_same_v<T, work_request_t>) return WorkRequest();
  if constexpr (std::is_same_v<T, candidates_t>) return Candidates();
  if constexpr (std::is_same_v<T, command_t>) return Command();
}

TYPED_TEST(Decode, TakesAWholeMessageAndNothingElse) {
  const Bytes bytes = Encode(Example<TypeParam>());
  TypeParam decoded;
  ASSERT_TRUE(DecodeMessage(bytes.data(), bytes.size(), &decoded));
  EXPECT_EQ(Encode(decoded), bytes);
  for (size_t size = 0; size < bytes.size(); ++size) {
    const Bytes shorter(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size));
    EXPECT_FALSE(DecodeMessage(shorter.data(), shorter.size(), &decoded)) << size;
  }
  Bytes longer = bytes;
  longer.push_back(0);
  EXPECT_FALSE(DecodeMessage(longer.data(), longer.size(), &decoded));
}

// What is taken has its own length: a changed length never reads or allocates beyond the bytes.
TYPED_TEST(Decode, TakesNoChangedLength) {
  const Bytes bytes = Encode(Example<TypeParam>());
  for (size_t place = 0; place < bytes.size(); ++place) {
    for (const uint8_t byte : {0x00, 0x01, 0x7F, 0x80, 0xFF}) {
      Bytes changed = bytes;
      changed[place] = byte;
      TypeParam decoded;
      if (!DecodeMessage(changed.data(), changed.size(), &decoded)) continue;
      EXPECT_EQ(static_cast<size_t>(decoded.getEncodedSize()), bytes.size()) << place;
    }
  }
}

TEST(TypeLayout, IsKnownOfAllTypes) {
  EXPECT_GE(TypeLayout::AllNames().size(), 30u);
  for (const std::string& name : TypeLayout::AllNames()) EXPECT_NO_THROW(TypeLayout::Of(name));
  EXPECT_THROW(TypeLayout::Of("unknown_t"), std::invalid_argument);
}

// lcm-gen's decoder subtracts one from this length and reads 2 GiB.
TEST(TypeLayout, RefusesAStringOfNegativeLength) {
  Bytes bytes = Encode(Command());
  bytes[8] = 0x80;  // the session's id, behind the fingerprint
  EXPECT_FALSE(TypeLayout::Of("command_t").Measure(bytes.data() + 8, bytes.size() - 8));
}

TEST(TypeLayout, RefusesAStringWithoutItsZero) {
  Bytes bytes = Encode(Command());
  bytes[8 + 4] = 'x';
  EXPECT_FALSE(TypeLayout::Of("command_t").Measure(bytes.data() + 8, bytes.size() - 8));
}

// lcm-gen's encoder writes such a text shorter than its length says.
TEST(TypeLayout, RefusesAStringWithAZeroInside) {
  command_t command = Command();
  command.session_id = "ab";
  Bytes bytes = Encode(command);
  const auto measured = [&] {
    return TypeLayout::Of("command_t").Measure(bytes.data() + 8, bytes.size() - 8);
  };
  ASSERT_TRUE(measured());
  bytes[8 + 4] = 0;
  EXPECT_FALSE(measured());
}

}  // namespace skein::type_layout_test
