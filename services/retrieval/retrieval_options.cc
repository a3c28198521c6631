#include "retrieval/retrieval_options.h"

#include <CLI/CLI.hpp>

#include "config/option_section.h"
#include "core/option_check.h"

namespace skein {

Status RetrievalServiceOptions::Check() const {
  return FirstError({InRange<size_t>("top_n", retrieval.top_n, 1, 200),
                     InRange<size_t>("expand", retrieval.num_expanding, 0, 100),
                     InRange<size_t>("ef", retrieval.hnsw.ef_search, 200, 100'000),
                     InRange("checkpoint_period", checkpoint_period_s, 0.1, 3600.0)});
}

void AddOptions(CLI::App& app, RetrievalServiceOptions* options) {
  RetrievalOptions& retrieval = options->retrieval;
  app.add_option("--top-n", retrieval.top_n, "Candidates a photo");
  app.add_option("--expand", retrieval.num_expanding,
                 "Photos that a query is expanded by; 0: none");
  app.add_option("--ef", retrieval.hnsw.ef_search, "Breadth of the search in the HNSW graph");
  AddSwitch(app, "exact", &retrieval.hnsw.exact, "Compare with every photo instead");
  app.add_option("--checkpoint-period", options->checkpoint_period_s,
                 "Seconds between checkpoints of the index");
}

}  // namespace skein
