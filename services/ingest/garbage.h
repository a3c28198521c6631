#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "event_loop/worker_thread.h"
#include "ingest/ledger_writer.h"
#include "ledger/session_folder.h"
#include "node/node.h"

namespace skein {

// Removes what the session no longer needs from blobs/: models that a newer one
// supersedes, blobs that no fact names, temporary files of processes that died. A blob is stored
// before the fact that names it, so only files of a certain age go. If a fact names one that went
// just before, ingest pulls it from its author again. A model that a fact has named goes at the
// second look that does not need it: a map of 600 photos writes one of 90 MB every 20 s. Loop's
// thread only.
class GarbageCollector {
 public:
  // period_s: between two looks.
  GarbageCollector(Node& node, LedgerWriter& writer, SessionPaths paths, double period_s);

  // Collects now and then; never during a finish, whose models are being read.
  void Tick(double now_s);

 private:
  void Remove(std::vector<std::filesystem::path> files);
  void AddSuperseded(const std::set<std::string>& needed,
                     std::vector<std::filesystem::path>* files);

  const LedgerWriter& writer_;
  const SessionPaths paths_;
  const double period_s_;
  double next_s_;
  // Models that facts have named since the start; true: not needed at the last look.
  std::map<std::string, bool> models_;
  WorkerThread worker_;  // last: ends first
};

// Files under the folder that were last written before then.
std::vector<std::filesystem::path> FilesWrittenBefore(const std::filesystem::path& dir,
                                                      std::filesystem::file_time_type before);

}  // namespace skein
