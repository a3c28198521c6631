// The shapes that mappers tell, pulled chunk by chunk.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "event_loop/alive.h"
#include "node/node.h"
#include "web/session_view.h"
#include "web/shape_store.h"

namespace skein {

// While somebody looks, asks the mappers for shapes, and keeps the newest of each submap in
// `store`. One pull a submap at a time. A blob that its owner no longer has ends it, and so do 10 s
// without a byte; the next shape begins another. Loop's thread only, but for NoteLook and
// MayUseModel.
class ShapeFollower {
 public:
  // on_shape: of that submap there is a new one. num_viewers: pages that are open.
  ShapeFollower(Node& node, const SessionView& view, ShapeStore& store,
                std::function<int()> num_viewers,
                std::function<void(int64_t submap_id, uint64_t version)> on_shape);
  ~ShapeFollower();
  ShapeFollower(const ShapeFollower&) = delete;
  ShapeFollower& operator=(const ShapeFollower&) = delete;

  // Somebody asks for a shape without a page. Any thread.
  void NoteLook();
  // Whether a submap may be shown by its newest model: its mapper was asked, and tells nothing. Any
  // thread.
  bool MayUseModel(int64_t submap_id) const;

 private:
  // A shape on its way.
  struct Pull {
    submap_shape_t told;
    std::shared_ptr<Shape> shape;
    size_t num_missing = 0;
    bool failed = false;
    std::vector<BlobClient::FetchId> fetches;
    int64_t progress = 0;  // bytes and blobs that came
    double progress_s = 0;
  };

  void Tick();
  bool IsLooking() const;
  void OnShape(const submap_shape_t& told);
  bool IsCurrent(const submap_shape_t& told) const;
  void PullNext(int64_t submap_id);
  void OnManifest(const std::shared_ptr<Pull>& pull, const Result<Bytes>& bytes);
  void OnPoints(const std::shared_ptr<Pull>& pull, size_t index, Result<Bytes> bytes);
  void OnPulled(const std::shared_ptr<Pull>& pull);
  void WatchPulls();
  void TellModels();

  Node& node_;
  const SessionView& view_;
  ShapeStore& store_;
  const std::function<int()> num_viewers_;
  const std::function<void(int64_t, uint64_t)> on_shape_;
  std::map<int64_t, submap_shape_t> newest_;        // by submap; not pulled yet
  std::map<int64_t, std::shared_ptr<Pull>> pulls_;  // by submap
  std::map<int64_t, std::string> told_models_;      // by submap: blob
  std::atomic<double> looked_s_;

  mutable std::mutex mutex_;
  std::map<int64_t, double> heard_s_;  // by submap; guarded by mutex_
  double looking_since_s_ = 0;         // 0: nobody looks; guarded by mutex_

  Bus::SubscriptionId subscription_ = 0;
  PollLoop::TimerId timer_ = 0;
  Alive alive_;
};

}  // namespace skein
