#pragma once

#include "core/result.h"

namespace CLI {
class App;
}

namespace skein {

struct MergerOptions {
  bool merge = true;  // submaps that overlap

  Status Check() const { return Status::Ok(); }
};

// [merger] of a config file.
void AddOptions(CLI::App& app, MergerOptions* options);

}  // namespace skein
