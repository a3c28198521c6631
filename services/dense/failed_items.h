// Photos on whose depth maps, or submaps on whose meshes, this process or those before it have
// failed.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "event_loop/step_record.h"

namespace skein {

constexpr int kMaxDenseFailures = 3;  // then an item is left out

// Counts outlive the process in SESSION/run/FILE, lines "ITEM COUNT". A file that cannot be read
// counts as none, one that cannot be written is logged.
class FailedItems {
 public:
  // session_dir: "" where this process does not share the folder; counts are then kept in memory
  // alone. `step`: name of the steps that count, also for the log. `left`: steps that the process
  // before left (StepRecord); counted if it died of `exit_signal` by a crash or a hang.
  FailedItems(const std::filesystem::path& session_dir, const std::string& file,
              const std::string& step, const std::vector<Step>& left, int exit_signal);

  // True: for the third time.
  bool Note(int64_t item);
  std::vector<int64_t> LeftOut() const;

 private:
  std::filesystem::path Path() const;
  void Read();
  void Write() const;

  const std::filesystem::path session_dir_;
  const std::string file_, step_;
  std::map<int64_t, int> counts_;
};

}  // namespace skein
