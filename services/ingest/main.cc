#include <CLI/CLI.hpp>
#include <stdexcept>

#include "ingest/ingest_service.h"
#include "node/node.h"

namespace {

void AddIngestOptions(CLI::App& app, skein::IngestOptions* options) {
  skein::PhotoLimits& limits = options->intake.limits;
  app.add_option("--max-bytes", limits.max_bytes, "Largest photo taken, in bytes")
      ->capture_default_str();
  app.add_option("--max-pixels", limits.max_pixels, "Largest photo taken, in pixels")
      ->capture_default_str();
  app.add_option("--min-side", limits.min_side_px, "Shortest side of a photo taken, in pixels")
      ->capture_default_str();
  app.add_option("--lease", options->leases.lease_s,
                 "Seconds after which a silent worker loses its work")
      ->check(CLI::Range(0.5, 3600.0))
      ->capture_default_str();
  app.footer("Exit codes: 0 stopped by a signal, 1 error, 2 bad usage.");
}

void CheckOptions(const skein::Node& node, const skein::IngestOptions& options) {
  if (!node.shares_folder()) {
    throw std::invalid_argument("ingest keeps the session folder: give --session DIR");
  }
  const skein::Status status = options.intake.limits.Check();
  if (!status.ok()) throw std::invalid_argument(status.error());
}

}  // namespace

int main(int argc, char** argv) {
  skein::NodeOptions node_options;
  node_options.service = "ingest";
  node_options.cache_bytes = 64 << 20;
  skein::IngestOptions options;
  CLI::App app("Takes photos in, keeps the session's ledger, hands out work, writes the models.");
  skein::AddCommonOptions(app, &node_options);
  AddIngestOptions(app, &options);
  if (const auto code = skein::ParseCommandLine(app, argc, argv)) return *code;
  return skein::RunService(node_options, [&](skein::Node& node) {
    CheckOptions(node, options);
    skein::IngestService service(node, options);
    node.Run();
  });
}
