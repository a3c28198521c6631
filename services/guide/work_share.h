// Work that takes at most a part of the time.
#pragma once

namespace skein {

class WorkShare {
 public:
  // share: above 0, at most 1.
  explicit WorkShare(double share) : share_(share) {}

  // Work of so many seconds has ended.
  void NoteWork(double seconds, double now_s) { due_s_ = now_s + seconds * (1 / share_ - 1); }
  // Before then no work is to begin.
  double due_s() const { return due_s_; }

 private:
  const double share_;
  double due_s_ = 0;
};

}  // namespace skein
