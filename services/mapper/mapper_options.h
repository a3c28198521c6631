#pragma once

#include "core/result.h"
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
  double retire_after_s = 0;  // without a submap, see MapperService; 0: never

  Status Check() const;
};

// [mapper] of a config file.
void AddOptions(CLI::App& app, MapperOptions* options);

}  // namespace skein
