#pragma once

#include "core/result.h"
#include "mapper/submap_run.h"

namespace CLI {
class App;
}

namespace skein {

struct MapperOptions {
  MapperOptions() { run.submap.background = true; }

  SubmapRunOptions run;
  double retire_after_s = 0;  // without a submap, see MapperService; 0: never

  Status Check() const;
};

// [mapper] of a config file.
void AddOptions(CLI::App& app, MapperOptions* options);

}  // namespace skein
