#pragma once

#include "core/result.h"
#include "mapper/mapper_service.h"
#include "mapper/submap_run.h"
#include "mapping/experiments/tree_window.h"

namespace CLI {
class App;
}

namespace skein {

struct MapperOptions {
  MapperOptions() { run.submap.background = true; }

  SubmapRunOptions run;
  LocalBaOptions local_ba;
  PoolOptions pool;

  Status Check() const;
};

// [mapper] of a config file.
void AddOptions(CLI::App& app, MapperOptions* options);

}  // namespace skein
