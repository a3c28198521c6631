#include "event_loop/failed_items.h"

#include <csignal>
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
  if (!IsCrash(exit_signal) && exit_signal != SIGKILL) return;
  for (const Step& died : left) {
    if (died.item <= 0 || died.name != step_) continue;
    Counts& counts = counts_[died.item];
    ++(exit_signal == SIGKILL ? counts.kills : counts.failures);
    Log(died.item, counts);
  }
  Write();
}

bool FailedItems::Note(int64_t item) {
  Counts& counts = counts_[item];
  ++counts.failures;
  Log(item, counts);
  Write();
  return counts.AreTooMany();
}

bool FailedItems::IsLeftOut(int64_t item) const {
  const auto found = counts_.find(item);
  return found != counts_.end() && found->second.AreTooMany();
}

std::vector<int64_t> FailedItems::LeftOut() const {
  std::vector<int64_t> items;
  for (const auto& [item, counts] : counts_) {
    if (counts.AreTooMany()) items.push_back(item);
  }
  return items;
}

void FailedItems::Log(int64_t item, const Counts& counts) const {
  LogWarn("{} {}: {} of {} failures, {} of {} SIGKILLs{}", step_, item, counts.failures,
          kMaxFailures, counts.kills, kMaxKills,
          counts.AreTooMany() ? "; it is left out from now on" : "");
}

std::filesystem::path FailedItems::Path() const { return session_dir_ / "run" / file_; }

void FailedItems::Read() {
  if (session_dir_.empty()) return;
  const Result<Bytes> bytes = ReadFileBelow(session_dir_, Path(), kMaxFileBytes);
  if (!bytes.ok()) return;
  std::istringstream lines(std::string(bytes->begin(), bytes->end()));
  int64_t item = 0;
  Counts counts;
  while (lines >> item >> counts.failures >> counts.kills) counts_[item] = counts;
}

void FailedItems::Write() const {
  if (session_dir_.empty()) return;
  std::string text;
  for (const auto& [item, counts] : counts_) {
    text += std::to_string(item) + " " + std::to_string(counts.failures) + " " +
            std::to_string(counts.kills) + "\n";
  }
  Status written = CreateFoldersBelow(session_dir_, Path().parent_path());
  if (written.ok()) written = WriteFileBelow(session_dir_, Path(), text.data(), text.size());
  if (!written.ok()) LogWarn("{}", written.error());
}

}  // namespace skein
