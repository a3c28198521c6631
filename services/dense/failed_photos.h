// Photos on whose depth maps this process, or those before it, have failed.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <vector>

#include "event_loop/step_record.h"

namespace skein {

constexpr int kMaxDenseFailures = 3;  // then a photo is left out

// Counts outlive the process in SESSION/run/dense.failed, lines "IMAGE COUNT". A file that cannot
// be read counts as none, one that cannot be written is logged.
class FailedPhotos {
 public:
  // session_dir: "" where this process does not share the folder; counts are then kept in memory
  // alone. `left`: steps that the process before left (StepRecord); counted if it died of
  // `exit_signal` by a crash or a hang.
  FailedPhotos(const std::filesystem::path& session_dir, const std::vector<Step>& left,
               int exit_signal);

  // True: for the third time.
  bool Note(uint32_t image_id);
  std::vector<uint32_t> LeftOut() const;

 private:
  void Read();
  void Write() const;

  const std::filesystem::path session_dir_;
  std::map<uint32_t, int> counts_;
};

}  // namespace skein
