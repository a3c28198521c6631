// State of a mapper's run of one submap: its life, and its activity within it. The tables of
// allowed transitions are in run_state.cc; everything else throws std::logic_error.
//
//   kAwaitingLease -> kSeeding | kRestoring -> kRunning -> kDissolving -> kEnded
#pragma once

namespace skein {

enum class Life {
  kAwaitingLease,  // until the ledger tells the lease, and the seed or a model
  kSeeding,        // loads the initial pair and starts the map
  kRestoring,      // loads the last model and its photos
  kRunning,        // works through the ledger's items
  kDissolving,     // tells that the submap is no more
  kEnded,
};
constexpr int kNumLives = 6;

enum class Activity {
  kNone,     // the next thing can begin
  kLoading,  // fetches blobs
  kJob,      // the worker is at the submap
  kMerging,  // from a merge's order to its end
  kWriting,  // the worker encodes the submap or starts a process that does
};
constexpr int kNumActivities = 5;

const char* NameOf(Life life);
const char* NameOf(Activity activity);

bool MayBecome(Life from, Life to);
bool MayBecome(Activity from, Activity to);
bool MayDo(Life life, Activity activity);

class RunState {
 public:
  Life life() const { return life_; }
  Activity activity() const { return activity_; }
  bool Is(Life life) const { return life_ == life; }
  bool Is(Activity activity) const { return activity_ == activity; }
  bool IsIdle() const { return activity_ == Activity::kNone; }

  // Enters a life; the former life's activity is over.
  void Become(Life life);
  void Become(Activity activity);

 private:
  Life life_ = Life::kAwaitingLease;
  Activity activity_ = Activity::kNone;
};

}  // namespace skein
