#include "retrieval/messages.h"

#include <gtest/gtest.h>

#include "ledger/facts.h"
#include "transport/bus.h"

namespace skein::messages_test {

Candidates SomeCandidates(int count) {
  Candidates candidates;
  candidates.image_id = 42;
  for (int i = 0; i < count; ++i) candidates.neighbours.push_back({10 + i, 0.125F * i});
  candidates.insert_s = 0.5F;
  candidates.query_s = 0.25F;
  return candidates;
}

TEST(RetrievalMessages, RoundTrip) {
  const candidates_t sent = ToMessage(SomeCandidates(3), 7);
  const Bytes bytes = EncodeFact(sent);
  const auto fact = DecodeFact(FactKindFromName("candidates"), bytes.data(), bytes.size());
  ASSERT_TRUE(fact.ok()) << fact.error();
  const auto& got = std::get<candidates_t>(*fact);
  EXPECT_EQ(got.header.fact_id, "candidates/42");
  EXPECT_EQ(got.header.computed_at_seq, 7);
  EXPECT_EQ(got.image_id, 42);
  EXPECT_EQ(got.num_candidates, 3);
  EXPECT_EQ(got.other_ids, (std::vector<int64_t>{10, 11, 12}));
  EXPECT_EQ(got.distances, (std::vector<float>{0, 0.125F, 0.25F}));
  EXPECT_EQ(got.insert_s, 0.5F);
  EXPECT_EQ(got.query_s, 0.25F);
}

TEST(RetrievalMessages, TheFirstPhotoHasNoCandidates) {
  const Bytes bytes = EncodeFact(ToMessage(SomeCandidates(0), 1));
  const auto fact = DecodeFact(FactKindFromName("candidates"), bytes.data(), bytes.size());
  ASSERT_TRUE(fact.ok()) << fact.error();
  EXPECT_EQ(std::get<candidates_t>(*fact).num_candidates, 0);
}

TEST(RetrievalMessages, SeventyCandidatesFitOneFrame) {
  candidates_t message = ToMessage(SomeCandidates(70), 123456);
  message.header.session_id = std::string(16, 's');
  message.header.author = "retrieval";
  EXPECT_LE(EncodeFact(message).size() + kMaxTrailerBytes, kMaxDatagramBytes);
}

}  // namespace skein::messages_test
