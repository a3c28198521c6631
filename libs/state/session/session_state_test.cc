#include "session/session_state.h"

#include <gtest/gtest.h>

#include "core/attempt.h"
#include "core/clock.h"
#include "ledger/fact_ids.h"
#include "session/submap_facts.h"
#include "testing/test_ledger.h"

namespace skein::session_state_test {

using Edges = std::map<int64_t, int64_t>;  // photo -> seq

class SessionStateTest : public testing::Test {
 protected:
  const SessionState& state() const { return ledger_.state(); }
  int64_t Matches(int64_t image_id, const std::vector<int64_t>& others) {
    std::vector<two_view_t> pairs;
    for (const int64_t other : others) pairs.push_back(TestLedger::Pair(other));
    return ledger_.Matches(image_id, pairs);
  }
  Edges NeighboursOf(int64_t image_id) const {
    Edges edges;
    for (const auto& edge : state().covisibility().EdgesOf(image_id)) {
      EXPECT_TRUE(edges.emplace(edge.other_id, edge.seq).second) << "a pair is kept once";
    }
    return edges;
  }
  // Two submaps with a mapper each.
  void TwoSubmaps() {
    for (const int64_t id : {1, 2}) {
      ledger_.Seed(id, 10 * id, 10 * id + 1);
      ledger_.Lease(id, 1);
    }
  }

  TestLedger ledger_;
};

TEST_F(SessionStateTest, KnowsNothingAtFirst) {
  EXPECT_EQ(state().FindPhoto(1), nullptr);
  EXPECT_EQ(state().FindSubmap(1), nullptr);
  EXPECT_FALSE(state().IsLive(1));
  EXPECT_EQ(state().FindMerge(1), nullptr);
  EXPECT_TRUE(state().failed_merges().empty());
  EXPECT_TRUE(state().covisibility().EdgesOf(1).empty());
  EXPECT_TRUE(state().RegisteredIn(1).empty());
  EXPECT_FALSE(state().IsRegistered(1));
  EXPECT_FALSE(state().WasSeeded(1, 2));
  EXPECT_FALSE(state().finishing());
}

TEST_F(SessionStateTest, FindsThePartsOfAPhoto) {
  image_t image{};
  image.image_id = 7;
  image.name = "a.jpg";
  features_t features{};
  features.image_id = 7;
  features.num_keypoints = 3;
  features.texture[383] = 128;
  candidates_t candidates{};
  candidates.image_id = 7;
  candidates.other_ids = {5};
  ledger_.Commit(image);
  EXPECT_EQ(state().FindPhoto(7)->features_seq, 0);
  EXPECT_FALSE(TextureOf(*state().FindPhoto(7)).has_value());
  ledger_.Commit(features);
  ledger_.Commit(candidates);
  ledger_.Seed(2, 7, 8);
  const int64_t matches = Matches(7, {});
  EXPECT_EQ(state().FindPhoto(7)->image.name, "a.jpg");
  EXPECT_EQ(state().FindPhoto(7)->features.num_keypoints, 3);
  const std::optional<TextureFields> texture = TextureOf(*state().FindPhoto(7));
  ASSERT_TRUE(texture.has_value());
  EXPECT_TRUE(texture->Has(63, 47));
  EXPECT_FALSE(texture->Has(62, 47));
  EXPECT_EQ(state().FindPhoto(7)->candidates.other_ids, std::vector<int64_t>{5});
  EXPECT_EQ(state().FindPhoto(7)->matches_seq, matches);
  EXPECT_EQ(state().FindSubmap(2)->seed.image_id1, 7);
  EXPECT_TRUE(state().WasSeeded(8, 7));
  EXPECT_EQ(state().FindPhoto(2), nullptr);
}

TEST_F(SessionStateTest, APairMakesBothPhotosNeighboursFromThenOn) {
  Matches(1, {});
  const int64_t second = Matches(2, {1});
  const int64_t third = Matches(3, {1, 2});
  EXPECT_EQ(NeighboursOf(1), (Edges{{2, second}, {3, third}}));
  EXPECT_EQ(NeighboursOf(2), (Edges{{1, second}, {3, third}}));
  EXPECT_EQ(NeighboursOf(3), (Edges{{1, third}, {2, third}}));
}

TEST_F(SessionStateTest, APairFoundFromBothSidesIsKnownSinceTheFirst) {
  const int64_t first = Matches(1, {2});
  Matches(2, {1});
  EXPECT_EQ(NeighboursOf(1).at(2), first);
  EXPECT_EQ(NeighboursOf(2).at(1), first);
}

TEST_F(SessionStateTest, APairKeepsWhatASeedIsChosenBy) {
  ledger_.Matches(2, {TestLedger::Pair(9, 120, 0.5F, 0.25F)});
  for (const int64_t id : {2, 9}) {
    const auto& edges = state().covisibility().EdgesOf(id);
    ASSERT_EQ(edges.size(), 1u);
    EXPECT_EQ(edges[0].other_id, 11 - id);
    EXPECT_EQ(edges[0].num_inliers, 120);
    EXPECT_EQ(edges[0].tri_angle_rad, 0.5F);
    EXPECT_EQ(edges[0].forward_motion, 0.25F);
  }
}

TEST_F(SessionStateTest, TheLatestWordOnAPhotoCounts) {
  ledger_.Register(1, 1);
  ledger_.Register(1, 2);
  ledger_.Register(1, 3, registration_t::DEFERRED);
  ledger_.Register(1, 1, registration_t::WITHDRAWN);
  ledger_.Register(2, 1);
  EXPECT_EQ(state().RegisteredIn(1), std::vector<int64_t>{2});
  EXPECT_EQ(state().RegisteredIn(2), std::vector<int64_t>{1});
  EXPECT_EQ(state().FindSubmap(1)->num_registered, 1);
  ledger_.Register(1, 1, registration_t::REGISTERED, 2);
  ledger_.Register(1, 1, registration_t::REGISTERED, 2);
  EXPECT_EQ(state().RegisteredIn(1), (std::vector<int64_t>{1, 2}));
  EXPECT_EQ(state().FindSubmap(1)->num_registered, 2);
}

TEST_F(SessionStateTest, FindsTheNewestModelAndLeaseOfASubmap) {
  ledger_.Lease(1, 1);
  EXPECT_FALSE(state().FindSubmap(1)->latest_model) << "a lease is no model";
  ledger_.Model(1, submap_model_t::CHECKPOINT);
  const int64_t lease = ledger_.Lease(1, 2);
  const int64_t final = ledger_.Model(1, submap_model_t::FINAL);
  ledger_.Model(2, submap_model_t::CHECKPOINT);
  EXPECT_EQ(state().FindSubmap(1)->latest_model->header.seq, final);
  EXPECT_EQ(state().FindSubmap(1)->lease.header.seq, lease);
  EXPECT_TRUE(state().IsLive(1));
  ledger_.End(1, "initial pair");
  EXPECT_FALSE(state().IsLive(1));
  EXPECT_EQ(state().FindSubmap(1)->end_reason, "initial pair");
  EXPECT_EQ(state().FindSubmap(1)->merged_into, 0);
  EXPECT_TRUE(state().IsLive(2));
}

TEST_F(SessionStateTest, ASubmapTakenOverAfterItsFinalModelStaysFinal) {
  ledger_.Lease(1, 1);
  ledger_.Model(1, submap_model_t::CHECKPOINT, 20, 7);
  EXPECT_EQ(state().FindSubmap(1)->final_ledger_seq, -1);
  ledger_.Model(1, submap_model_t::FINAL, 30, 8);
  ledger_.Lease(1, 2, "mapper-2");
  const SubmapLife& submap = *state().FindSubmap(1);
  EXPECT_EQ(submap.lease.owner, "mapper-2");
  EXPECT_EQ(submap.latest_model->kind, +submap_model_t::FINAL);
  EXPECT_EQ(submap.latest_model->num_images, 8);
  EXPECT_EQ(submap.latest_model->ledger_seq, 30) << "the next mapper goes on from here";
  EXPECT_EQ(submap.final_ledger_seq, 30);
  ledger_.Model(1, submap_model_t::CHECKPOINT, 40, 9);
  EXPECT_EQ(submap.latest_model->ledger_seq, 40);
  EXPECT_EQ(submap.final_ledger_seq, 30);
}

TEST_F(SessionStateTest, KeepsTheFactsOfAMerge) {
  const int64_t merge_id = ledger_.Order(2, 1);
  ledger_.MergeStep(merge_id, merge_t::FROZEN);
  EXPECT_TRUE(state().FindMerge(merge_id)->is_open());
  ledger_.MergeStep(merge_id, merge_t::UNDONE);
  const MergeState& merge = *state().FindMerge(merge_id);
  ASSERT_EQ(merge.facts.size(), 3u);
  EXPECT_EQ(merge.ordered().state, +merge_t::ORDERED);
  EXPECT_EQ(merge.latest().state, +merge_t::UNDONE);
  EXPECT_FALSE(merge.is_open());
}

TEST_F(SessionStateTest, AFailedMergeWasNeverOrdered) {
  TwoSubmaps();
  ledger_.FailMerge(2, 1, 5);
  EXPECT_TRUE(state().merges().empty());
  ASSERT_EQ(state().failed_merges().size(), 1u);
  EXPECT_EQ(state().failed_merges()[0].num_shared_images, 5);
  for (const int64_t id : {1, 2}) {
    EXPECT_EQ(state().FindSubmap(id)->open_merge_id, 0);
    EXPECT_TRUE(state().IsLive(id));
  }
}

TEST_F(SessionStateTest, AMergeThatIsDoneEndsItsSource) {
  TwoSubmaps();
  for (const int64_t id : {20, 21, 22}) ledger_.Register(2, id);
  const int64_t merge_id = ledger_.Order(2, 1);
  EXPECT_EQ(state().FindSubmap(1)->open_merge_id, merge_id);
  EXPECT_EQ(state().FindSubmap(2)->open_merge_id, merge_id);
  // The target tells of two photos that came; the third found no place.
  for (const int64_t id : {20, 21}) ledger_.Register(1, id);
  ledger_.MergeStep(merge_id, merge_t::DONE);
  EXPECT_FALSE(state().IsLive(2)) << "also before its end fact";
  EXPECT_EQ(state().FindSubmap(2)->merged_into, 1);
  EXPECT_EQ(state().FindSubmap(2)->end_reason, "merged into map 1");
  EXPECT_EQ(state().FindSubmap(1)->open_merge_id, 0);
  EXPECT_TRUE(state().IsRegistered(21));
  EXPECT_FALSE(state().IsRegistered(22)) << "no submap that lives holds it";
  ledger_.Commit(MakeMergedEnd(state().FindMerge(merge_id)->latest(), state()));
  EXPECT_EQ(state().FindSubmap(2)->merged_into, 1);
  EXPECT_EQ(state().FindSubmap(2)->end_reason, "merged into map 1");
}

TEST_F(SessionStateTest, TheEndOfASubmapEndsItsMergeForTheOtherToo) {
  TwoSubmaps();
  const int64_t first = ledger_.Order(2, 1);
  ledger_.End(2, "no mapper");
  EXPECT_EQ(state().FindSubmap(1)->open_merge_id, 0);
  EXPECT_TRUE(state().FindMerge(first)->abandoned);
  EXPECT_FALSE(state().FindMerge(first)->is_open());
  ledger_.Seed(3, 30, 31);
  const int64_t second = ledger_.Order(3, 1);
  ledger_.MergeStep(first, merge_t::UNDONE);
  EXPECT_EQ(state().FindSubmap(1)->open_merge_id, second) << "a late word on the first";
}

TEST_F(SessionStateTest, AnEndHasOneId) {
  TwoSubmaps();
  const submap_end_t end = MakeSubmapEnd(2, 1, std::string(500, 'x'));
  EXPECT_EQ(end.header.fact_id, SubmapEndFactId(2));
  EXPECT_EQ(end.merged_into, 0);
  EXPECT_EQ(end.reason.size(), 200u) << "it must fit a message";
  merge_t done{};
  done.source_id = 2;
  done.target_id = 1;
  EXPECT_EQ(MakeMergedEnd(done, state()).header.fact_id, end.header.fact_id);
  EXPECT_EQ(MakeMergedEnd(done, state()).merged_into, 1);
  EXPECT_EQ(MakeMergedEnd(done, state()).epoch, 1);
}

TEST_F(SessionStateTest, RemembersTheLatestDrainedOverFinishes) {
  ledger_.Finish(finish_t::REQUESTED);
  const int64_t drained = ledger_.Finish(finish_t::DRAINED);
  EXPECT_EQ(state().finish().drained_seq, drained);
  ledger_.Finish(finish_t::SETTLED);
  ledger_.Finish(finish_t::DONE);
  ledger_.Finish(finish_t::REQUESTED);
  EXPECT_EQ(state().finish().drained_seq, 0) << "of this finish";
  EXPECT_EQ(state().last_drained_seq(), drained);
}

TEST_F(SessionStateTest, FactsOutOfOrderAreABrokenContract) {
  SessionState fresh;
  image_t image{};
  image.header.seq = 2;
  EXPECT_THROW(fresh.Apply(image), BrokenState);
}

// Ten thousand photos of which the last half is matched with a hub that all of them see.
TEST_F(SessionStateTest, AFactsCostDoesNotGrowWithTheLedger) {
  const auto seconds = [this](int64_t first, int64_t last) {
    const double start_s = ThreadCpuS();
    for (int64_t id = first; id <= last; ++id) {
      std::vector<int64_t> others = {1};
      for (int64_t other = id - 1; other > 1 && other > id - 30; --other) others.push_back(other);
      Matches(id, others);
      ledger_.Register(1, id);
    }
    return ThreadCpuS() - start_s;
  };
  Matches(1, {});
  const double early_s = seconds(2, 1000) + seconds(1001, 2000);
  seconds(2001, 8000);
  const double late_s = seconds(8001, 10000);
  RecordProperty("early_s", std::to_string(early_s));
  RecordProperty("late_s", std::to_string(late_s));
  EXPECT_LT(late_s, 5 * early_s + 0.5) << "quadratic would be nine times as much";
  EXPECT_EQ(state().covisibility().EdgesOf(1).size(), 9999u);
}

}  // namespace skein::session_state_test
