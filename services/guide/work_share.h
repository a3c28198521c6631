// Work that takes at most a part of the time, however long it waits for a core meanwhile.
#pragma once

namespace skein {

class WorkShare {
 public:
  // share: above 0, at most 1.
  explicit WorkShare(double share) : share_(share) {}

  // Work that began then took so many seconds of processor time.
  void NoteWork(double cpu_s, double begin_s) { due_s_ = begin_s + cpu_s / share_; }
  // Before then no work is to begin.
  double due_s() const { return due_s_; }

 private:
  const double share_;
  double due_s_ = 0;
};

}  // namespace skein
