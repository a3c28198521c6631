#pragma once

#include "core/result.h"

namespace CLI {
class App;
}

namespace skein {

struct MergerOptions {
  bool merge = true;                // submaps that overlap
  double wait_for_mapper_s = 15.0;  // when finishing, for one that could take a seed

  Status Check() const;
};

// [merger] of a config file.
void AddOptions(CLI::App& app, MergerOptions* options);

}  // namespace skein
