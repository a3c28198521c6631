#pragma once

#include "core/result.h"
#include "ingest/finish_driver.h"
#include "ingest/photo_intake.h"
#include "node/service_options.h"

namespace CLI {
class App;
}

namespace skein {

struct IngestOptions {
  IntakeOptions intake;
  FinishOptions finish;
  double garbage_period_s = 60;  // between two looks for garbage; only tests have a shorter one

  Status Check() const;
};

// [ingest] of a config file.
void AddOptions(CLI::App& app, IngestOptions* options);

// With the entries [[cameras]], which go into options->intake.cameras.
Program IngestProgram(NodeOptions* node, IngestOptions* options);

}  // namespace skein
