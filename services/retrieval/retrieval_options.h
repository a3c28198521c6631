#pragma once

#include "core/result.h"
#include "retrieval/retrieval_state.h"

namespace CLI {
class App;
}

namespace skein {

struct RetrievalServiceOptions {
  RetrievalOptions retrieval;
  double checkpoint_period_s = 10;

  Status Check() const;
};

// [retrieval] of a config file.
void AddOptions(CLI::App& app, RetrievalServiceOptions* options);

}  // namespace skein
