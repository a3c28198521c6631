#include "dense/failed_items.h"

#include <sstream>

#include "core/file_below.h"
#include "core/log.h"
#include "event_loop/exit_signal.h"

namespace skein {
namespace {

constexpr size_t kMaxFileBytes = 1 << 20;

}  // namespace

FailedItems::FailedItems(const std::filesystem::path& session_dir, const std::string& file,
                         const std::string& step, const std::vector<Step>& left, int exit_signal)
    : session_dir_(session_dir), file_(file), step_(step) {
  Read();
  if (!IsCrash(exit_signal)) return;
  for (const Step& died : left) {
    if (died.item > 0 && died.name == step_) Note(died.item);
  }
}

bool FailedItems::Note(int64_t item) {
  const int count = ++counts_[item];
  LogWarn("{} {}: failure {} of {}", step_, item, count, kMaxDenseFailures);
  Write();
  return count >= kMaxDenseFailures;
}

std::vector<int64_t> FailedItems::LeftOut() const {
  std::vector<int64_t> items;
  for (const auto& [item, count] : counts_) {
    if (count >= kMaxDenseFailures) items.push_back(item);
  }
  return items;
}

std::filesystem::path FailedItems::Path() const { return session_dir_ / "run" / file_; }

void FailedItems::Read() {
  if (session_dir_.empty()) return;
  const Result<Bytes> bytes = ReadFileBelow(session_dir_, Path(), kMaxFileBytes);
  if (!bytes.ok()) return;
  std::istringstream lines(std::string(bytes->begin(), bytes->end()));
  int64_t item = 0;
  int count = 0;
  while (lines >> item >> count) counts_[item] = count;
}

void FailedItems::Write() const {
  if (session_dir_.empty()) return;
  std::string text;
  for (const auto& [item, count] : counts_) {
    text += std::to_string(item) + " " + std::to_string(count) + "\n";
  }
  Status written = CreateFoldersBelow(session_dir_, Path().parent_path());
  if (written.ok()) written = WriteFileBelow(session_dir_, Path(), text.data(), text.size());
  if (!written.ok()) LogWarn("{}", written.error());
}

}  // namespace skein
