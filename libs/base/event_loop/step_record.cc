#include "event_loop/step_record.h"

#include <fcntl.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <sstream>
#include <utility>

#include "core/file_below.h"
#include "core/log.h"
#include "core/process.h"

namespace skein {
namespace {

// A line a slot: LIFE ITEM NAME, padded. One write replaces it whole.
constexpr size_t kLineBytes = 128;

// A signal's handler may look at these alone.
thread_local unsigned own_slots = 0;  // a bit a slot in which this thread has a step
std::atomic<int> crash_fd{-1};        // the file of the record that crashes are told in
char empty_line[kLineBytes];

std::string LineOf(int64_t life, const std::vector<Step>& stack) {
  std::string line = std::to_string(life) + " ";
  line += stack.empty() ? "0" : std::to_string(stack.back().item) + " " + stack.back().name;
  line.resize(kLineBytes - 1, ' ');
  return line + '\n';
}

// A crash is put down to the thread that it happens in: the steps of others leave the file. Where
// that thread has none, all stay.
void OnCrash(int signal) {
  const int fd = crash_fd;
  for (int slot = 0; slot < StepRecord::kNumSlots && own_slots != 0 && fd >= 0; ++slot) {
    if ((own_slots >> slot & 1u) != 0) continue;
    if (::pwrite(fd, empty_line, kLineBytes, slot * static_cast<off_t>(kLineBytes)) < 0) break;
  }
  ::raise(signal);  // SA_RESETHAND: as without a handler
}

void TellCrashes(int fd, int64_t life) {
  LineOf(life, {}).copy(empty_line, kLineBytes);
  crash_fd = fd;
  struct sigaction action {};
  action.sa_handler = OnCrash;
  action.sa_flags = SA_RESETHAND | SA_NODEFER;
  for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT})
    ::sigaction(signal, &action, nullptr);
}

}  // namespace

StepRecord::StepRecord(const std::string& path)
    : life_(static_cast<int64_t>(RandomU64() >> 2) + 1) {
  if (path.empty()) return;
  const std::filesystem::path session = std::filesystem::path(path).parent_path().parent_path();
  Result<FileDescriptor> file = OpenFileBelow(session, path, O_RDWR | O_CREAT);
  if (!file.ok()) {
    LogWarn("{} (SKEIN_STEP_FILE); a crash is put down to what ingest heard last", file.error());
    return;
  }
  fd_ = file->Release();
  Read();
  for (int slot = 0; slot < kNumSlots; ++slot) Write(slot);
  TellCrashes(fd_, life_);
}

StepRecord::~StepRecord() {
  if (fd_ < 0) return;
  int fd = fd_;
  crash_fd.compare_exchange_strong(fd, -1);
  ::close(fd_);
}

std::string StepRecord::FileOfSupervisor() {
  const char* path = std::getenv("SKEIN_STEP_FILE");
  return path == nullptr ? "" : path;
}

void StepRecord::Read() {
  for (int slot = 0; slot < kNumSlots; ++slot) {
    char line[kLineBytes];
    const ssize_t size = ::pread(fd_, line, sizeof(line), slot * static_cast<off_t>(kLineBytes));
    if (size <= 0) return;
    std::istringstream words(std::string(line, static_cast<size_t>(size)));
    int64_t life = 0;
    Step step;
    if (!(words >> life >> step.item) || step.item == 0) continue;
    std::getline(words >> std::ws, step.name);
    step.name.erase(step.name.find_last_not_of(' ') + 1);
    left_life_ = life;
    left_.push_back(std::move(step));
  }
}

void StepRecord::Write(int slot) {
  if (fd_ < 0) return;
  const std::string line = LineOf(life_, slots_[slot].stack);
  // A full disk: ingest goes by what it heard last.
  if (::pwrite(fd_, line.data(), line.size(), slot * static_cast<off_t>(kLineBytes)) < 0) return;
}

StepRecord::Scope::Scope(StepRecord* record, int slot, Step step)
    : record_(*record), slot_(slot), num_exceptions_(std::uncaught_exceptions()) {
  Slot& own = record_.slots_[slot_];
  own.stack.push_back(std::move(step));
  own_slots |= 1u << slot_;
  record_.Write(slot_);
  if (!record_.on_begin_) return;
  try {
    record_.on_begin_(own.stack.back());
  } catch (...) {
    own.thrown = own.stack.back();
    End();
    throw;
  }
}

StepRecord::Scope::~Scope() {
  Slot& own = record_.slots_[slot_];
  const bool is_thrown = std::uncaught_exceptions() > num_exceptions_;
  if (is_thrown && own.thrown.item == 0) own.thrown = own.stack.back();
  End();
}

void StepRecord::Scope::End() {
  record_.slots_[slot_].stack.pop_back();
  if (record_.slots_[slot_].stack.empty()) own_slots &= ~(1u << slot_);
  record_.Write(slot_);
}

Step StepRecord::TakeThrown(int slot) { return std::exchange(slots_[slot].thrown, Step()); }

}  // namespace skein
