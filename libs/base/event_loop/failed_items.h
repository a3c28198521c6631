// Items on which this process or those before it have failed, of services that lease none. Ingest
// counts leased items (services/ingest/work_queue.h).
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "core/attempt.h"
#include "event_loop/step_record.h"

namespace skein {

// An item is left out after kMaxFailures exceptions, crashes or hangs, or kMaxKills SIGKILLs
// (core/attempt.h). Counts outlive the process in SESSION/run/FILE, lines "ITEM FAILURES KILLS". A
// file that cannot be read counts as none, one that cannot be written is logged.
class FailedItems {
 public:
  // session_dir: "" where this process does not share the folder; counts are then kept in memory
  // alone. `step`: name of the steps that count, also for the log. `left`: steps that the process
  // before left (StepRecord); counted if it died of `exit_signal` by a crash, a hang or SIGKILL.
  FailedItems(const std::filesystem::path& session_dir, const std::string& file,
              const std::string& step, const std::vector<Step>& left, int exit_signal);

  // True: the item is left out from now on.
  bool Note(int64_t item);
  bool IsLeftOut(int64_t item) const;
  std::vector<int64_t> LeftOut() const;

 private:
  struct Counts {
    int failures = 0;
    int kills = 0;
    bool AreTooMany() const { return failures >= kMaxFailures || kills >= kMaxKills; }
  };

  void Log(int64_t item, const Counts& counts) const;
  std::filesystem::path Path() const;
  void Read();
  void Write() const;

  const std::filesystem::path session_dir_;
  const std::string file_, step_;
  std::map<int64_t, Counts> counts_;
};

}  // namespace skein
