#include "mapper/run_state.h"

#include <gtest/gtest.h>

#include <set>
#include <stdexcept>
#include <utility>
#include <vector>

namespace skein::run_state_test {

constexpr Life kLives[] = {Life::kAwaitingLease, Life::kSeeding,    Life::kRestoring,
                           Life::kRunning,       Life::kDissolving, Life::kEnded};
constexpr Activity kActivities[] = {Activity::kNone, Activity::kLoading, Activity::kJob,
                                    Activity::kMerging, Activity::kWriting};

// The shortest way to a life.
RunState In(Life life) {
  static const std::vector<std::vector<Life>> kWays = {{},
                                                       {Life::kSeeding},
                                                       {Life::kRestoring},
                                                       {Life::kSeeding, Life::kRunning},
                                                       {Life::kSeeding, Life::kDissolving},
                                                       {Life::kEnded}};
  RunState state;
  for (const Life step : kWays[static_cast<int>(life)]) state.Become(step);
  return state;
}

TEST(RunState, AwaitsItsLeaseAtFirst) {
  EXPECT_TRUE(RunState().Is(Life::kAwaitingLease));
  EXPECT_TRUE(RunState().IsIdle());
}

TEST(RunState, WalksItsLivesAsDrawn) {
  const std::set<std::pair<Life, Life>> allowed = {
      {Life::kAwaitingLease, Life::kSeeding}, {Life::kAwaitingLease, Life::kRestoring},
      {Life::kAwaitingLease, Life::kEnded},   {Life::kSeeding, Life::kRunning},
      {Life::kSeeding, Life::kDissolving},    {Life::kSeeding, Life::kEnded},
      {Life::kRestoring, Life::kRunning},     {Life::kRestoring, Life::kEnded},
      {Life::kRunning, Life::kDissolving},    {Life::kRunning, Life::kEnded},
      {Life::kDissolving, Life::kEnded}};
  for (const Life from : kLives) {
    for (const Life to : kLives) {
      RunState state = In(from);
      ASSERT_TRUE(state.Is(from));
      if (allowed.count({from, to}) > 0) {
        EXPECT_NO_THROW(state.Become(to));
        EXPECT_TRUE(state.Is(to));
      } else {
        EXPECT_THROW(state.Become(to), std::logic_error) << NameOf(from) << " to " << NameOf(to);
        EXPECT_TRUE(state.Is(from));
      }
    }
  }
}

TEST(RunState, DoesOneThingAtATime) {
  for (const Activity from : kActivities) {
    for (const Activity to : kActivities) {
      RunState state = In(Life::kRunning);
      if (from != Activity::kNone) state.Become(from);
      const bool ends = from != Activity::kNone && to == Activity::kNone;
      const bool begins = from == Activity::kNone && to != Activity::kNone;
      const bool loaded = from == Activity::kLoading && to == Activity::kJob;
      if (ends || begins || loaded) {
        EXPECT_NO_THROW(state.Become(to));
        EXPECT_EQ(state.activity(), to);
      } else {
        EXPECT_THROW(state.Become(to), std::logic_error) << NameOf(from) << " to " << NameOf(to);
        EXPECT_EQ(state.activity(), from);
      }
    }
  }
}

TEST(RunState, OnlyARunningSubmapMergesAndWrites) {
  for (const Life life : kLives) {
    const bool loads = life == Life::kSeeding || life == Life::kRestoring || life == Life::kRunning;
    for (const Activity activity : {Activity::kLoading, Activity::kJob}) {
      RunState state = In(life);
      if (loads) {
        EXPECT_NO_THROW(state.Become(activity));
      } else {
        EXPECT_THROW(state.Become(activity), std::logic_error) << NameOf(life);
      }
    }
    for (const Activity activity : {Activity::kMerging, Activity::kWriting}) {
      RunState state = In(life);
      if (life == Life::kRunning) {
        EXPECT_NO_THROW(state.Become(activity));
      } else {
        EXPECT_THROW(state.Become(activity), std::logic_error) << NameOf(life);
      }
    }
  }
}

TEST(RunState, AnEndEndsWhatIsBeingDone) {
  for (const Activity activity : {Activity::kLoading, Activity::kJob}) {
    RunState state = In(Life::kSeeding);
    state.Become(activity);
    state.Become(Life::kEnded);
    EXPECT_TRUE(state.IsIdle());
  }
}

}  // namespace skein::run_state_test
