#include "clients/other_files.h"

#include <filesystem>

#include "photo/heif.h"

namespace skein {
namespace {

constexpr std::array<const char*, 6> kWhyNotTaken = {" (JPEG, PNG and TIFF are)",
                                                     " (depth maps or masks beside photos)",
                                                     " (hidden photos, thumbnails and trash)",
                                                     " (links to folders that are read anyway)",
                                                     " (links that lead nowhere)",
                                                     " (folders that may not be read)"};

}  // namespace

void OtherFilesTeller::Tell(const OtherFiles& others) {
  const std::array<std::string, 6> groups = {others.kinds,    others.companions, others.skipped,
                                             others.repeated, others.dangling,   others.unreadable};
  for (size_t i = 0; i < groups.size(); ++i) {
    if (groups[i] == told_[i]) continue;
    told_[i] = groups[i];
    if (groups[i].empty()) continue;
    out_ << "skein agent: not taken in " << folder_ << ": " << groups[i] << kWhyNotTaken[i];
    if (i == 0 && others.have_heif) out_ << ". HEIC: " << kHeifAdvice;
    out_ << std::endl;
  }
}

void OtherFilesTeller::LookAgain(double now_s) {
  if (now_s < next_look_s_) return;
  next_look_s_ = now_s + kLookForOthersS;
  try {
    Tell(FindOtherFiles(folder_));
  } catch (const std::filesystem::filesystem_error&) {
    // FolderWatch tells that the folder is gone.
  }
}

}  // namespace skein
