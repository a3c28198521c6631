#include "mapper/run_state.h"

#include <array>
#include <stdexcept>
#include <string>

namespace skein {
namespace {

template <int kRows, int kColumns>
using Table = std::array<std::array<bool, kColumns>, kRows>;

// Row: from. Column: to, in the order of the enum.
constexpr Table<kNumLives, kNumLives> kLives{{
    // lease, seeding, restoring, running, dissolving, ended
    {false, true, true, false, false, true},    // kAwaitingLease
    {false, false, false, true, true, true},    // kSeeding: the initial pair may fail
    {false, false, false, true, false, true},   // kRestoring
    {false, false, false, false, true, true},   // kRunning: the initial pair may be refused
    {false, false, false, false, false, true},  // kDissolving
    {false, false, false, false, false, false},
}};

constexpr Table<kNumActivities, kNumActivities> kActivities{{
    // none, loading, job, merging, writing
    {false, true, true, true, true},
    {true, false, true, false, false},  // kLoading: what was loaded goes into a job, or it failed
    {true, false, false, false, false},
    {true, false, false, false, false},
    {true, false, false, false, false},
}};

// Row: life. Column: activity.
constexpr Table<kNumLives, kNumActivities> kWithin{{
    // none, loading, job, merging, writing
    {true, false, false, false, false},
    {true, true, true, false, false},
    {true, true, true, false, false},
    {true, true, true, true, true},
    {true, false, false, false, false},
    {true, false, false, false, false},
}};

template <class T>
[[noreturn]] void Refuse(const char* within, T from, T to) {
  throw std::logic_error(std::string("a mapper's run that is ") + within + " goes from " +
                         NameOf(from) + " to " + NameOf(to));
}

}  // namespace

const char* NameOf(Life life) {
  constexpr const char* kNames[kNumLives] = {
      "awaiting its lease", "seeding", "restoring", "running", "dissolving", "ended"};
  return kNames[static_cast<int>(life)];
}

const char* NameOf(Activity activity) {
  constexpr const char* kNames[kNumActivities] = {"none", "loading", "job", "merging", "writing"};
  return kNames[static_cast<int>(activity)];
}

bool MayBecome(Life from, Life to) { return kLives[static_cast<int>(from)][static_cast<int>(to)]; }

bool MayBecome(Activity from, Activity to) {
  return kActivities[static_cast<int>(from)][static_cast<int>(to)];
}

bool MayDo(Life life, Activity activity) {
  return kWithin[static_cast<int>(life)][static_cast<int>(activity)];
}

void RunState::Become(Life life) {
  if (!MayBecome(life_, life)) Refuse(NameOf(life_), life_, life);
  life_ = life;
  activity_ = Activity::kNone;
}

void RunState::Become(Activity activity) {
  if (!MayBecome(activity_, activity) || !MayDo(life_, activity)) {
    Refuse(NameOf(life_), activity_, activity);
  }
  activity_ = activity;
}

}  // namespace skein
