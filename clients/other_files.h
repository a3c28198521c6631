// Tells what lies in an agent's folder and is not taken: other kinds of files, depth maps, masks,
// thumbnails, trash.
#pragma once

#include <array>
#include <string>

#include "clients/photo_folder.h"

namespace skein {

// Seconds between two looks at a folder that is watched: a look walks all of it and opens the
// beginning of each file that is no photo.
inline constexpr double kLookForOthersS = 10;

class OtherFilesTeller {
 public:
  OtherFilesTeller(std::string folder, std::ostream& out) : folder_(std::move(folder)), out_(out) {}

  // Writes a line for each group of files (OtherFiles) that is not as it was told last.
  void Tell(const OtherFiles& others);

  // Looks at the folder and tells, unless it did so less than kLookForOthersS before. A folder that
  // cannot be read is left as it was told. `now_s` is any monotonic time.
  void LookAgain(double now_s);

 private:
  const std::string folder_;
  std::ostream& out_;
  std::array<std::string, 6> told_;  // kinds, companions, skipped, repeated, dangling, unreadable
  double next_look_s_ = 0;
};

}  // namespace skein
