// Queue of frames to be sent to one client, fair among their senders.
//
// Deficit round robin (Shreedhar and Varghese, SIGCOMM 1995): each sender has its turn, and in it
// as many bytes as any other. If the queue is full, the sender with most bytes loses its newest
// frame. A sender that floods therefore fills no other's share, and delays no other by more than a
// turn.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <list>
#include <map>
#include <memory>

#include "core/bytes.h"

namespace skein {

// A frame as it is sent, shared by the queues that hold it.
class SharedFrame {
 public:
  // `held_bytes` counts this frame while it lives.
  SharedFrame(Bytes bytes, std::shared_ptr<size_t> held_bytes);
  ~SharedFrame();
  SharedFrame(const SharedFrame&) = delete;
  SharedFrame& operator=(const SharedFrame&) = delete;

  const Bytes& bytes() const { return bytes_; }
  // Bytes that count against a limit: the frame's own and its overhead.
  size_t cost() const { return bytes_.size() + 128; }

 private:
  const Bytes bytes_;
  const std::shared_ptr<size_t> held_bytes_;
};

class FairFrameQueue {
 public:
  using FramePtr = std::shared_ptr<const SharedFrame>;
  static constexpr size_t kTurnBytes = 32 << 10;

  explicit FairFrameQueue(size_t max_bytes) : max_bytes_(max_bytes) {}

  // Appends to the sender's frames, which keep their order. Says how many frames were lost for it,
  // of this sender or another.
  int64_t Push(int64_t sender, const FramePtr& frame);
  // The next one; null if there is none.
  FramePtr Pop();
  // How many were dropped.
  int64_t Clear();

  bool empty() const { return flows_.empty(); }
  size_t bytes() const { return bytes_; }

 private:
  struct Flow {
    std::deque<FramePtr> frames;
    size_t bytes = 0;
    size_t deficit = 0;  // bytes left of its turn
    std::list<int64_t>::iterator turn;
  };
  using Flows = std::map<int64_t, Flow>;

  Flows::iterator Largest();
  void DropNewest(Flows::iterator flow);
  void Forget(Flows::iterator flow);

  const size_t max_bytes_;
  size_t bytes_ = 0;
  Flows flows_;               // by sender; none is empty
  std::list<int64_t> turns_;  // senders, the first has its turn
};

}  // namespace skein
