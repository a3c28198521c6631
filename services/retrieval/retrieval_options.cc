#include "retrieval/retrieval_options.h"

#include <CLI/CLI.hpp>

#include "config/option_section.h"
#include "core/option_check.h"

namespace skein {

Status RetrievalOptions::Check() const {
  return FirstError({InRange<size_t>("top_n", top_n, 1, 200),
                     InRange<size_t>("expand", num_expanding, 0, 100),
                     InRange<size_t>("ef", hnsw.ef_search, 200, 100'000)});
}

void AddOptions(CLI::App& app, RetrievalOptions* options) {
  app.add_option(
      "--top-n", options->top_n,
      "Candidates of a photo: 30 to be matched, further ones for photos with few overlaps");
  app.add_option("--expand", options->num_expanding, "Photos that a query is expanded by; 0: none");
  app.add_option("--ef", options->hnsw.ef_search, "Breadth of the search in the HNSW graph");
  AddSwitch(app, "exact", &options->hnsw.exact, "Compare with every photo instead");
}

}  // namespace skein
