#pragma once

#include <cstddef>

#include "core/result.h"
#include "retrieval/hnsw_index.h"

namespace CLI {
class App;
}

namespace skein {

struct RetrievalOptions {
  // Candidates of a photo. Matching always considers the first kShortlist = 30 of them; it compares
  // the others only while a photo has few overlaps (services/matching/second_look.h).
  size_t top_n = 200;
  size_t num_expanding = 5;  // photos that a query is expanded by (hnsw_index.h); 0: none
  HnswOptions hnsw;

  Status Check() const;
};

// [retrieval] of a config file.
void AddOptions(CLI::App& app, RetrievalOptions* options);

}  // namespace skein
