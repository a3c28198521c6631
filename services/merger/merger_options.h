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
  double wait_for_mapper_s = 15.0;  // when finishing, for one that could take a seed

  Status Check() const;
};

// [merger] of a config file.
void AddOptions(CLI::App& app, MergerOptions* options);

}  // namespace skein
