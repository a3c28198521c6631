#include <CLI/CLI.hpp>

#include "node/node.h"
#include "retrieval/retrieval_service.h"

int main(int argc, char** argv) {
  skein::NodeOptions options;
  options.service = "retrieval";
  skein::RetrievalServiceOptions service_options;
  auto& retrieval = service_options.retrieval;
  CLI::App app("Finds the photos most like each new one, by their global descriptors.");
  skein::AddCommonOptions(app, &options);
  app.add_option("--top", retrieval.top_n, "Candidates a photo")
      ->check(CLI::Range(1, 200))
      ->capture_default_str();
  app.add_option("--expand", retrieval.num_expanding, "Photos that a query is expanded by")
      ->check(CLI::Range(0, 100))
      ->capture_default_str();
  app.add_option("--ef", retrieval.hnsw.ef_search, "Breadth of the search in the HNSW graph")
      ->check(CLI::Range(200, 100000))
      ->capture_default_str();
  app.add_flag("--exact", retrieval.hnsw.exact, "Compare with every photo instead");
  app.add_option("--checkpoint-period", service_options.checkpoint_period_s,
                 "Seconds between checkpoints of the index")
      ->check(CLI::Range(0.1, 3600.0))
      ->capture_default_str();
  if (const auto code = skein::ParseCommandLine(app, argc, argv)) return *code;

  return skein::RunService(options, [&](skein::Node& node) {
    skein::RetrievalService service(node, service_options);
    node.Run();
  });
}
