#include "matching/second_look.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <numeric>
#include <stdexcept>

namespace skein::second_look_test {

constexpr int64_t kPhoto = 1000;
constexpr int64_t kNow = 100;

bool IsEarlier(int64_t other_id) { return other_id < kPhoto; }

std::vector<int64_t> Range(int64_t first, int64_t count) {
  std::vector<int64_t> ids(count);
  std::iota(ids.begin(), ids.end(), first);
  return ids;
}

// Photos first .. first + count - 1, every two of which share `inliers`.
void AddPlace(int64_t first, int64_t count, int32_t inliers, CovisibilityGraph* graph,
              int64_t seq = 1) {
  for (int64_t a = first; a < first + count; ++a) {
    for (int64_t b = first; b < a; ++b) graph->Add(a, b, inliers, seq);
  }
}

// All that may be in work now.
std::vector<int64_t> TakeAll(SecondLook* look) {
  std::vector<int64_t> taken;
  while (const auto id = look->Take()) taken.push_back(*id);
  return taken;
}

// Works until nothing is left to take, with the outcomes given, 0 where none is. Of those in work
// the last one taken ends first, if `last_first`.
std::vector<int64_t> Work(SecondLook* look, const std::map<int64_t, int32_t>& inliers,
                          bool last_first = false) {
  std::vector<int64_t> tried, in_work;
  while (true) {
    for (const int64_t id : TakeAll(look)) {
      tried.push_back(id);
      in_work.push_back(id);
    }
    if (in_work.empty()) break;
    const auto ends = last_first ? in_work.end() - 1 : in_work.begin();
    const auto found = inliers.find(*ends);
    look->Tell(*ends, found == inliers.end() ? 0 : found->second);
    in_work.erase(ends);
  }
  EXPECT_EQ(look->num_in_work(), 0u);
  return tried;
}

std::vector<int64_t> Tried(SecondLook look, const std::map<int64_t, int32_t>& inliers,
                           bool last_first = false) {
  const std::vector<int64_t> tried = Work(&look, inliers, last_first);
  EXPECT_EQ(look.num_tried(), tried.size());
  return tried;
}

bool Has(const std::vector<int64_t>& ids, int64_t id) {
  return std::count(ids.begin(), ids.end(), id) > 0;
}

TEST(SecondLook, WithNothingKnownItIsPlainMatchingInTheOrderOfRetrieval) {
  const CovisibilityGraph nothing;
  const std::vector<int64_t> candidates{7, 3, 9, 1, 5};
  EXPECT_EQ(Tried(SecondLook(candidates, nothing, kNow, IsEarlier, true), {{3, 80}, {1, 200}}),
            candidates);
  EXPECT_TRUE(Tried(SecondLook({}, nothing, kNow, IsEarlier, true), {}).empty());
}

TEST(SecondLook, SwitchedOffItTriesAllCandidatesAndNoOthers) {
  CovisibilityGraph graph;
  AddPlace(1, 40, 300, &graph);
  const auto candidates = Range(1, 30);
  EXPECT_EQ(Tried(SecondLook(candidates, graph, kNow, IsEarlier, false), {{2, 300}}), candidates);
}

TEST(SecondLook, OneFailureSpeaksForTheRestOfItsPlace) {
  CovisibilityGraph graph;
  AddPlace(1, 10, 300, &graph);
  const auto tried = Tried(SecondLook(Range(1, 10), graph, kNow, IsEarlier, true), {});
  EXPECT_EQ(tried, Range(1, 1));
}

// The next photo of a walk: it overlaps with the last ones. Those before show little of these.
TEST(SecondLook, AFailureSaysLittleOfAPhotoThatSharesLittle) {
  CovisibilityGraph graph;
  graph.Add(10, 11, 3000, 1);
  graph.Add(11, 12, 2300, 1);
  graph.Add(7, 10, 550, 1);
  for (const int64_t id : {7, 18}) graph.Add(id, 12, 27, 1);  // false matches, as such few are
  const std::map<int64_t, int32_t> inliers{{10, 270}, {11, 760}, {12, 1300}};
  const auto tried = Tried(SecondLook({7, 18, 10, 11, 12}, graph, kNow, IsEarlier, true), inliers);
  for (const int64_t id : {10, 11, 12}) EXPECT_TRUE(Has(tried, id)) << id;
}

TEST(SecondLook, EveryPlaceIsTriedHoweverWellAnotherOneFits) {
  CovisibilityGraph graph;
  AddPlace(1, 18, 300, &graph);
  AddPlace(101, 5, 300, &graph);
  auto candidates = Range(1, 18);
  candidates.push_back(103);  // the other place, and a photo without any pair, last of the sure
  candidates.push_back(500);
  std::map<int64_t, int32_t> inliers;
  for (const int64_t id : Range(1, 18)) inliers[id] = 200;
  const auto tried = Tried(SecondLook(candidates, graph, kNow, IsEarlier, true), inliers);
  EXPECT_TRUE(Has(tried, 103));
  EXPECT_TRUE(Has(tried, 500));
}

TEST(SecondLook, LateCandidatesAreTriedWhileFewPairsOverlap) {
  const CovisibilityGraph nothing;
  const auto candidates = Range(1, 30);
  std::map<int64_t, int32_t> inliers;
  for (const int64_t id : Range(1, 5)) inliers[id] = 200;
  EXPECT_EQ(Tried(SecondLook(candidates, nothing, kNow, IsEarlier, true), inliers), candidates);
  inliers[6] = 200;
  EXPECT_EQ(Tried(SecondLook(candidates, nothing, kNow, IsEarlier, true), inliers), Range(1, 20));
}

TEST(SecondLook, LateCandidatesThatShouldOverlapAreTried) {
  CovisibilityGraph graph;
  graph.Add(1, 30, 400, 1);
  graph.Add(1, 29, 60, 1);
  std::map<int64_t, int32_t> inliers;
  for (const int64_t id : Range(1, 8)) inliers[id] = 200;
  const auto tried = Tried(SecondLook(Range(1, 30), graph, kNow, IsEarlier, true), inliers);
  EXPECT_TRUE(Has(tried, 30));
  EXPECT_FALSE(Has(tried, 28));
}

TEST(SecondLook, StopsWhenTheRestIsImplied) {
  CovisibilityGraph graph;
  AddPlace(1, 30, 300, &graph);
  std::map<int64_t, int32_t> inliers;
  for (const int64_t id : Range(1, 30)) inliers[id] = 200;
  const auto tried = Tried(SecondLook(Range(1, 30), graph, kNow, IsEarlier, true), inliers);
  EXPECT_GE(tried.size(), 12u);
  EXPECT_LT(tried.size(), 15u) << "three are in work at once";
}

TEST(SecondLook, PhotosThatRetrievalMissedJoinThroughVerifiedNeighbours) {
  CovisibilityGraph graph;
  graph.Add(1, 50, 400, 1);
  graph.Add(1, 51, 20, 1);  // weak: not worth a try
  graph.Add(2, 60, 400, 1);
  graph.Add(1, 2000, 400, 1);  // later than the photo: its own matching covers the pair
  const auto tried = Tried(SecondLook({1, 2}, graph, kNow, IsEarlier, true), {{1, 300}, {50, 120}});
  EXPECT_TRUE(Has(tried, 50));
  EXPECT_FALSE(Has(tried, 51));
  EXPECT_FALSE(Has(tried, 60)) << "a neighbour of one that failed";
  EXPECT_FALSE(Has(tried, 2000));
}

TEST(SecondLook, JoinsAreBounded) {
  CovisibilityGraph graph;
  for (const int64_t id : Range(100, 50)) graph.Add(1, id, 400, 1);
  const auto tried = Tried(SecondLook({1}, graph, kNow, IsEarlier, true), {{1, 500}});
  EXPECT_LE(tried.size(), 11u);
  EXPECT_GT(tried.size(), 1u);
}

TEST(SecondLook, DoesNotSeeWhatTheLedgerToldLater) {
  CovisibilityGraph graph;
  AddPlace(1, 10, 300, &graph, kNow + 1);
  EXPECT_EQ(Tried(SecondLook(Range(1, 10), graph, kNow, IsEarlier, true), {}), Range(1, 10));
}

TEST(SecondLook, SeesWhatBecomesKnownMeanwhile) {
  CovisibilityGraph graph;
  AddPlace(1, 10, 300, &graph, kNow + 1);
  SecondLook look(Range(1, 10), graph, kNow, IsEarlier, true);
  for (const int64_t id : TakeAll(&look)) look.Tell(id, 0);
  EXPECT_FALSE(look.Best(1).empty());
  look.Advance(kNow + 1);
  EXPECT_FALSE(look.Take()) << "those that failed are of the same place";
  look.Advance(kNow);
  EXPECT_EQ(look.seq(), kNow + 1);
}

TEST(SecondLook, EveryEdgeCountsOnceHoweverOftenItAdvances) {
  CovisibilityGraph graph;
  graph.Add(1, 2, 40, kNow + 1);  // one such failure is too little evidence, two would not be
  // Works through all before 7, whose outcomes it has learned when 7, 8 and 9 are in work.
  const auto tell_first = [](SecondLook* look) {
    for (auto id = look->Take(); id && id != 7; id = look->Take()) look->Tell(*id, 0);
    TakeAll(look);
  };
  SecondLook look({1, 7, 8, 9, 2}, graph, kNow, IsEarlier, true);
  tell_first(&look);
  for (int64_t seq = kNow; seq <= kNow + 3; ++seq) look.Advance(seq);
  look.Tell(7, 0);
  EXPECT_EQ(look.Take(), 2);
  graph.Add(3, 2, 40, kNow + 4);
  SecondLook both({1, 3, 7, 8, 9, 2}, graph, kNow, IsEarlier, true);
  tell_first(&both);
  both.Advance(kNow + 4);
  both.Tell(7, 0);
  EXPECT_FALSE(both.Take());
}

TEST(SecondLook, ExpectsMostOfThoseWhoShareMostWithGoodPairs) {
  CovisibilityGraph graph;
  graph.Add(1, 30, 60, 1);
  graph.Add(1, 31, 500, 1);
  SecondLook look({1, 30, 31}, graph, kNow, IsEarlier, true);
  ASSERT_EQ(look.Take(), 1);
  EXPECT_FALSE(look.Take()) << "1 will speak for both";
  look.Tell(1, 400);
  EXPECT_EQ(look.Take(), 31);
}

// One that is slow holds up what is known, so that the choice is the same on any machine.
TEST(SecondLook, WhichOfThoseInWorkEndsFirstDoesNotMatter) {
  CovisibilityGraph graph;
  AddPlace(1, 12, 300, &graph);
  AddPlace(21, 12, 60, &graph);
  graph.Add(3, 50, 400, 1);
  const std::vector<int64_t> candidates{1, 21, 70, 2, 22, 3, 23, 4, 71, 5, 24, 6};
  std::map<int64_t, int32_t> inliers;
  for (const int64_t id : Range(1, 12)) inliers[id] = static_cast<int32_t>(40 * id);
  const auto tried = Tried(SecondLook(candidates, graph, kNow, IsEarlier, true), inliers);
  EXPECT_GE(tried.size(), 5u);
  EXPECT_EQ(Tried(SecondLook(candidates, graph, kNow, IsEarlier, true), inliers, true), tried);
}

// Nothing is known of 2 but what 1 will say, so the third goes first.
TEST(SecondLook, WhatOneInWorkWillSpeakForWaits) {
  CovisibilityGraph graph;
  AddPlace(1, 2, 300, &graph);
  SecondLook look({1, 2, 9}, graph, kNow, IsEarlier, true);
  EXPECT_EQ(TakeAll(&look), (std::vector<int64_t>{1, 9}));
  look.Tell(9, 100);
  EXPECT_FALSE(look.Take()) << "9 counts when 1 is told";
  look.Tell(1, 100);
  EXPECT_EQ(look.Take(), 2);
}

TEST(SecondLook, RefusesToBeToldTwiceOrOfWhatItDidNotGive) {
  const CovisibilityGraph nothing;
  SecondLook look({1, 2}, nothing, kNow, IsEarlier, true);
  EXPECT_THROW(look.Tell(1, 20), std::invalid_argument);
  TakeAll(&look);
  look.Tell(2, 20);
  EXPECT_THROW(look.Tell(2, 20), std::invalid_argument);
}

// The 31st candidate and further are matched only if somebody asks for them.
TEST(SecondLook, ALonelyPhotoIsComparedWithAllThatWereNotTried) {
  const CovisibilityGraph nothing;
  SecondLook look(Range(1, 40), nothing, kNow, IsEarlier, true);
  EXPECT_EQ(Work(&look, {{1, 80}, {2, 80}}).size(), 30u);
  EXPECT_EQ(look.ToCompare(), Range(31, 10));
}

TEST(SecondLook, APhotoWithThreePairsIsComparedWithLonelyOnes) {
  CovisibilityGraph graph;
  AddPlace(31, 5, 80, &graph);
  SecondLook look(Range(1, 40), graph, kNow, IsEarlier, true);
  EXPECT_EQ(Work(&look, {{1, 80}, {2, 80}, {3, 80}}).size(), 30u);
  EXPECT_EQ(look.ToCompare(), Range(36, 5));
}

TEST(SecondLook, WhoIsLonelyDoesNotDependOnLaterFacts) {
  CovisibilityGraph graph;
  AddPlace(31, 5, 80, &graph, kNow + 1);
  SecondLook look(Range(1, 35), graph, kNow, IsEarlier, true);
  Work(&look, {{1, 80}, {2, 80}, {3, 80}});
  EXPECT_EQ(look.ToCompare(), Range(31, 5));
}

TEST(SecondLook, ChosenCandidatesAreTaken) {
  const CovisibilityGraph nothing;
  SecondLook look(Range(1, 40), nothing, kNow, IsEarlier, true);
  Work(&look, {});
  look.Choose({35, 3});
  EXPECT_EQ(Work(&look, {{35, 20}}), std::vector<int64_t>{35});
}

TEST(SecondLook, SwitchedOffItComparesWithNone) {
  const CovisibilityGraph nothing;
  SecondLook look(Range(1, 40), nothing, kNow, IsEarlier, false);
  EXPECT_EQ(Work(&look, {}).size(), 30u);
  EXPECT_TRUE(look.ToCompare().empty());
}

}  // namespace skein::second_look_test
