#pragma once

#include <string>

#include "core/result.h"
#include "matching/kernel.h"

namespace CLI {
class App;
}

namespace skein {

struct MatchingServiceOptions {
  KernelVersion kernel = FastestKernel();
  bool cascade = true;        // off: the full product of each pair
  bool second_look = true;    // off: all candidates, in their order
  int cache_mib = 512;        // features of recently used photos, decoded
  std::string codebook_path;  // of the cascade's cells; "": the one shipped with Skein

  Status Check() const;
};

// [matching] of a config file.
void AddOptions(CLI::App& app, MatchingServiceOptions* options);

}  // namespace skein
