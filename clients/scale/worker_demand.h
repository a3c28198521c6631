// How many workers a session could use.
#pragma once

#include <cstdint>

#include "session/session_history.h"
#include "session/session_tally.h"

namespace skein {

// Seconds that an item of a stage is taken to need before the session has done one.
constexpr double kUnknownItemS = 2;

struct WorkerDemand {
  int64_t num_photos = 0;  // before the end of matching
  double work_s = 0;       // of one worker alone, until all of them are through matching
};

// Sum over features and matching of backlog x mean seconds an item, both as /metrics tells them
// (docs/metrics.md): a photo that waits for features or retrieval needs matching, too.
WorkerDemand DemandOf(const SessionTally& tally, const StageTimes& times);

// ceil(work_s / target_s), between `min` and `max`. target_s > 0.
int NumWanted(double work_s, double target_s, int min, int max);

}  // namespace skein
