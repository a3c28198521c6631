#pragma once

#include "retrieval/retrieval_state.h"

namespace CLI {
class App;
}

namespace skein {

// [retrieval] of a config file.
void AddOptions(CLI::App& app, RetrievalOptions* options);

}  // namespace skein
