#include "dense/failed_photos.h"

#include <limits>
#include <sstream>
#include <string>

#include "core/file_below.h"
#include "core/log.h"
#include "event_loop/exit_signal.h"

namespace skein {
namespace {

constexpr size_t kMaxFileBytes = 1 << 20;

std::filesystem::path FileOf(const std::filesystem::path& session_dir) {
  return session_dir / "run" / "dense.failed";
}

}  // namespace

FailedPhotos::FailedPhotos(const std::filesystem::path& session_dir, const std::vector<Step>& left,
                           int exit_signal)
    : session_dir_(session_dir) {
  Read();
  if (!IsCrash(exit_signal)) return;
  for (const Step& step : left) {
    const bool is_photo = step.item > 0 && step.item <= std::numeric_limits<uint32_t>::max();
    if (is_photo) Note(static_cast<uint32_t>(step.item));
  }
}

bool FailedPhotos::Note(uint32_t image_id) {
  const int count = ++counts_[image_id];
  LogWarn("image {}: no depth map, failure {} of {}", image_id, count, kMaxDenseFailures);
  Write();
  return count >= kMaxDenseFailures;
}

std::vector<uint32_t> FailedPhotos::LeftOut() const {
  std::vector<uint32_t> ids;
  for (const auto& [id, count] : counts_) {
    if (count >= kMaxDenseFailures) ids.push_back(id);
  }
  return ids;
}

void FailedPhotos::Read() {
  if (session_dir_.empty()) return;
  const Result<Bytes> bytes = ReadFileBelow(session_dir_, FileOf(session_dir_), kMaxFileBytes);
  if (!bytes.ok()) return;
  std::istringstream lines(std::string(bytes->begin(), bytes->end()));
  uint32_t id = 0;
  int count = 0;
  while (lines >> id >> count) counts_[id] = count;
}

void FailedPhotos::Write() const {
  if (session_dir_.empty()) return;
  std::string text;
  for (const auto& [id, count] : counts_) {
    text += std::to_string(id) + " " + std::to_string(count) + "\n";
  }
  const std::filesystem::path file = FileOf(session_dir_);
  Status written = CreateFoldersBelow(session_dir_, file.parent_path());
  if (written.ok()) written = WriteFileBelow(session_dir_, file, text.data(), text.size());
  if (!written.ok()) LogWarn("{}", written.error());
}

}  // namespace skein
