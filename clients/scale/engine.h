// An engine runs worker jobs: a script scripts/engines/NAME.sh, so that another engine is another
// file.
//
//   NAME.sh list                 prints a line a job of this session: its worker's name, "waiting"
//                                or "running", and why it waits
//   NAME.sh submit BATCH [JOB_OPTION...] -- [LAUNCH_OPTION...]
//                                reads one invitation a line; for line I a job runs
//                                scripts/worker_job.sh BATCH-I I LAUNCH_OPTION... with these lines
//                                as its input
//   NAME.sh cancel WORKER...     sends their processes SIGTERM; SIGKILL after 5 s at the earliest
//
// A script fails with its reason on the last line of stderr. Exit code 2: this host cannot run the
// engine at all. A script keeps nothing between calls: what it lists comes from the engine itself.
// Environment: SKEIN_SESSION_ID, SKEIN_SCALE_FOLDER (a folder of this host), SKEIN_WORKER_CORES.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "clients/scale/worker_pool.h"
#include "core/result.h"

namespace skein {

// Names of the engines beside this program, sorted.
std::vector<std::string> EngineNames();

// All calls block, for at most a minute. Any thread, one call at a time
// (clients/scale/engine_thread.h). An error is one line, by the engine; kFailedPrecondition: exit
// code 2.
class Engine {
 public:
  virtual ~Engine() = default;

  virtual Result<std::vector<WorkerJob>> List() = 0;
  // A job for each invitation. Job I, from 1, is the worker `batch`-I.
  virtual Status Submit(const std::string& batch, const std::vector<std::string>& invitations,
                        const std::vector<std::string>& job_options,
                        const std::vector<std::string>& launch_options) = 0;
  virtual Status Cancel(const std::vector<std::string>& workers) = 0;
};

// `name` is one of EngineNames.
std::unique_ptr<Engine> OpenEngine(const std::string& name);

}  // namespace skein
