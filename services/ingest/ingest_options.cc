#include "ingest/ingest_options.h"

#include <CLI/CLI.hpp>

#include "core/option_check.h"

namespace skein {

Status IngestOptions::Check() const {
  return FirstError({intake.limits.Check(), InRange("max_pending", intake.max_pending, 1, 100'000),
                     InRange("max_pending_agent", intake.max_pending_agent, 1, 100'000),
                     InRange<int64_t>("min_free", intake.min_free_bytes, 0, int64_t{1} << 60),
                     InRange("min_model_size", finish.min_model_size, 2, 10'000),
                     InRange("cut_grace", finish.cut_grace_s, 0.0, 3600.0)});
}

void AddOptions(CLI::App& app, IngestOptions* options) {
  PhotoLimits& limits = options->intake.limits;
  app.add_option("--max-bytes", limits.max_bytes, "Largest photo taken, in bytes");
  app.add_option("--max-pixels", limits.max_pixels, "Largest photo taken, in pixels");
  app.add_option("--min-side", limits.min_side_px, "Shortest side of a photo taken, in pixels");
  app.add_option("--decoder", options->intake.decoder.program,
                 "Program that decodes photos; default: skein-decoder beside this program");
  app.add_option("--max-pending", options->intake.max_pending,
                 "Photos taken in at a time; more are told to wait");
  app.add_option("--max-pending-agent", options->intake.max_pending_agent,
                 "Photos taken in at a time of one agent; more are told to wait");
  app.add_option("--min-free", options->intake.min_free_bytes,
                 "Bytes that must be free on the session's disk for a photo to be taken in");
  app.add_option("--min-model-size", options->finish.min_model_size,
                 "Photos that a model has at least; a smaller one is given up at the finish");
  app.add_option("--cut-grace", options->finish.cut_grace_s,
                 "Seconds that mappers have to write their models when the time of a finish is up; "
                 "then the newest ones in the ledger are taken");
}

Program IngestProgram(NodeOptions* node, IngestOptions* options) {
  Program program = ServiceProgram(
      "Takes photos in, keeps the session's ledger, hands out work, writes the models.", node);
  program.add_options = [options](CLI::App& app) { AddOptions(app, options); };
  program.check = [options] { return options->Check(); };
  std::vector<KnownCamera>* cameras = &options->intake.cameras;
  program.read_more = [cameras](const ConfigFile& file) { return ReadKnownCameras(file, cameras); };
  program.print_more = [cameras](bool with_comments) {
    return KnownCamerasText(*cameras, with_comments);
  };
  return program;
}

}  // namespace skein
