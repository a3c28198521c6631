#include "relay/fair_queue.h"

#include <algorithm>
#include <utility>

namespace skein {

SharedFrame::SharedFrame(Bytes bytes, std::shared_ptr<size_t> held_bytes)
    : bytes_(std::move(bytes)), held_bytes_(std::move(held_bytes)) {
  *held_bytes_ += cost();
}

SharedFrame::~SharedFrame() { *held_bytes_ -= cost(); }

int64_t FairFrameQueue::Push(int64_t sender, const FramePtr& frame) {
  auto [flow, is_new] = flows_.try_emplace(sender);
  if (is_new) {
    flow->second.turn = turns_.insert(turns_.end(), sender);
    flow->second.deficit = kTurnBytes;
  }
  flow->second.frames.push_back(frame);
  flow->second.bytes += frame->cost();
  bytes_ += frame->cost();
  int64_t num_dropped = 0;
  for (; bytes_ > max_bytes_; ++num_dropped) DropNewest(Largest());
  return num_dropped;
}

FairFrameQueue::FramePtr FairFrameQueue::Pop() {
  while (!turns_.empty()) {
    const auto flow = flows_.find(turns_.front());
    Flow& first = flow->second;
    const size_t cost = first.frames.front()->cost();
    if (first.deficit < cost) {
      first.deficit += kTurnBytes;
      turns_.splice(turns_.end(), turns_, first.turn);
      continue;
    }
    FramePtr frame = std::move(first.frames.front());
    first.frames.pop_front();
    first.deficit -= cost;
    first.bytes -= cost;
    bytes_ -= cost;
    if (first.frames.empty()) Forget(flow);
    return frame;
  }
  return nullptr;
}

int64_t FairFrameQueue::Clear() {
  int64_t num_frames = 0;
  for (const auto& [sender, flow] : flows_) num_frames += static_cast<int64_t>(flow.frames.size());
  flows_.clear();
  turns_.clear();
  bytes_ = 0;
  return num_frames;
}

FairFrameQueue::Flows::iterator FairFrameQueue::Largest() {
  return std::max_element(flows_.begin(), flows_.end(), [](const auto& a, const auto& b) {
    return a.second.bytes < b.second.bytes;
  });
}

void FairFrameQueue::DropNewest(Flows::iterator flow) {
  const size_t cost = flow->second.frames.back()->cost();
  flow->second.frames.pop_back();
  flow->second.bytes -= cost;
  bytes_ -= cost;
  if (flow->second.frames.empty()) Forget(flow);
}

void FairFrameQueue::Forget(Flows::iterator flow) {
  turns_.erase(flow->second.turn);
  flows_.erase(flow);
}

}  // namespace skein
