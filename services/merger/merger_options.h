#pragma once

#include "core/result.h"
#include "geometry/sim3_ransac.h"
#include "merger/merge_policy.h"
#include "merger/seed_policy.h"

namespace CLI {
class App;
}

namespace skein {

struct MergerOptions {
  SeedOptions seed;
  MergeOptions merge;
  Sim3Options sim3;
  double decide_period_s = 0.1;
  double request_period_s = 0.5;    // of an unanswered request for shared images
  double request_timeout_s = 20.0;  // then the attempt is given up, and made again
  double idle_mapper_s = 3.0;       // a mapper that asked for work within this is idle
  double hold_after_refusal_s = 1.0;
  double wait_for_mapper_s = 15.0;  // when finishing, for one that could take a seed

  Status Check() const;
};

// [merger] of a config file.
void AddOptions(CLI::App& app, MergerOptions* options);

}  // namespace skein
