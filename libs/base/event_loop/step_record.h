// Records the steps that a process works on, for the process that replaces it: a crash or a hang
// counts against them.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "core/attempt.h"

namespace skein {

// A part of the work on an item, whose failures are counted separately.
struct Step {
  int64_t item = 0;  // 0: none
  std::string name;

  bool operator==(const Step& other) const { return item == other.item && name == other.name; }
};

// Steps under way, one stack a thread, kept in a file that outlives the process. A write to the
// file survives every death of the process, not that of the host. Each slot belongs to one thread.
// After a crash the file holds the steps of the thread that crashed alone, if it had any.
class StepRecord {
 public:
  static constexpr int kNumSlots = 4;

  // Reads what the process before left in the file, then clears it. "": no file; steps are kept in
  // memory alone. A file that cannot be opened is the same, and logged. The file is
  // SESSION/run/NAME: below SESSION no symbolic link is followed (core/file_below.h).
  explicit StepRecord(const std::string& path);
  ~StepRecord();
  StepRecord(const StepRecord&) = delete;
  StepRecord& operator=(const StepRecord&) = delete;

  // The file that the supervisor names in SKEIN_STEP_FILE; "" without one.
  static std::string FileOfSupervisor();

  // For tests: called on the slot's thread when a step begins. An exception of `observer` fails the
  // step.
  void OnBegin(std::function<void(const Step&)> observer) { on_begin_ = std::move(observer); }

  // The innermost steps of the process before: of the thread that crashed, else of each thread that
  // had one.
  const std::vector<Step>& left() const { return left_; }
  // A name for that process's life; 0: there was none, or it had no step.
  int64_t left_life() const { return left_life_; }
  // Name of this process's life.
  int64_t life() const { return life_; }

  // A step is under way as long as its scope lives, on the slot's thread.
  class Scope {
   public:
    Scope(StepRecord* record, int slot, Step step);
    ~Scope();
    Scope(const Scope&) = delete;
    Scope& operator=(const Scope&) = delete;

   private:
    void End();

    StepRecord& record_;
    const int slot_;
    const int num_exceptions_;
  };

  // The innermost step that an exception has left since the last call; item 0 if none has. On the
  // slot's thread.
  Step TakeThrown(int slot);

 private:
  struct Slot {
    std::vector<Step> stack;
    Step thrown;
  };

  void Read();
  void Write(int slot);

  int fd_ = -1;
  const int64_t life_;
  int64_t left_life_ = 0;
  std::vector<Step> left_;
  std::array<Slot, kNumSlots> slots_;
  std::function<void(const Step&)> on_begin_;
};

// Attempt of a step: the work is under way in `record` meanwhile. On the slot's thread.
template <class Work>
AttemptResult<Work> AttemptStep(StepRecord* record, int slot, Step step, Work&& work) {
  return Attempt([&] {
    const StepRecord::Scope scope(record, slot, std::move(step));
    return work();
  });
}

}  // namespace skein
