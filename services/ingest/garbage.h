#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/result.h"
#include "event_loop/worker_thread.h"
#include "ingest/ledger_writer.h"
#include "ledger/session_folder.h"
#include "node/node.h"

namespace skein {

struct GarbageOptions {
  double period_s = 60;
  double min_age_s = 600;  // of a file that may go, since it was written

  Status Check() const;
};

// Removes what the session no longer needs from blobs/: models that a newer one
// supersedes, blobs that no fact names, temporary files of processes that died. A blob is stored
// before the fact that names it, so only files of a certain age go. If a fact names one that went
// just before, ingest pulls it from its author again. Loop's thread only.
class GarbageCollector {
 public:
  GarbageCollector(Node& node, const LedgerWriter& writer, SessionPaths paths,
                   const GarbageOptions& options);

  // Collects now and then; never during a finish, whose models are being read.
  void Tick(double now_s);

 private:
  void Remove(const std::vector<std::filesystem::path>& old_files);

  const LedgerWriter& writer_;
  const SessionPaths paths_;
  const GarbageOptions options_;
  double next_s_;
  WorkerThread worker_;  // last: ends first
};

// Files under the folder that were last written before then.
std::vector<std::filesystem::path> FilesWrittenBefore(const std::filesystem::path& dir,
                                                      std::filesystem::file_time_type before);

}  // namespace skein
