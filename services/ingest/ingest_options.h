#pragma once

#include "core/result.h"
#include "ingest/finish_driver.h"
#include "ingest/photo_intake.h"
#include "ingest/work_queue.h"
#include "node/service_options.h"

namespace CLI {
class App;
}

namespace skein {

struct IngestOptions {
  IntakeOptions intake;
  double lease_s = kUsualLeaseS;  // of work; lapses when its worker has been silent for so long
  FinishOptions finish;
  double garbage_period_s = 60;  // between two looks for files that nothing needs
  double garbage_age_s = 600;    // of a file that may go, since it was written

  Status Check() const;
};

// [ingest] of a config file.
void AddOptions(CLI::App& app, IngestOptions* options);

// With the entries [[cameras]], which go into options->intake.cameras.
Program IngestProgram(NodeOptions* node, IngestOptions* options);

}  // namespace skein
