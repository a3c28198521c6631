// Map snapshots (shapes) that mappers publish, pulled chunk by chunk.
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
#include "session/session_state.h"
#include "shapes/shape_store.h"

namespace skein {

struct ShapeFollowerOptions {
  // Lends the session's state to its argument. Loop's thread.
  std::function<void(const std::function<void(const SessionState&)>&)> read_session;
  // Whether shapes are wanted, besides by NoteLook. Loop's thread.
  std::function<bool()> is_wanted;
  // Pulls the tracks of the points, too (Shape::Chunk::tracks).
  bool with_tracks = false;
  // Called when the store has a new shape of that submap.
  std::function<void(int64_t submap_id, uint64_t version)> on_shape;
  // Called when a submap's mapper publishes no shape, and its model is newer than the stored shape.
  // `version`: for the shape to be made of the model. Null: models are not looked at.
  std::function<void(int64_t submap_id, uint64_t version)> on_model;
};

// Shapes with tracks while any submap lives, for a process that follows the ledger itself. `state`
// outlives the follower.
ShapeFollowerOptions FollowLiveSubmaps(const SessionState& state);

// While they are wanted, asks the mappers for shapes, and keeps the newest of each submap in
// `store`. One pull a submap at a time. A blob that its owner no longer has ends it, and so do 10 s
// without a byte; the next shape begins another. Loop's thread only, but for NoteLook and
// MayUseModel.
class ShapeFollower {
 public:
  ShapeFollower(Node& node, ShapeStore& store, ShapeFollowerOptions options);
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

  struct WantedBlob;

  void Tick();
  bool IsWanted() const;
  void OnShape(const submap_shape_t& told);
  bool IsCurrent(const submap_shape_t& told) const;
  void PullNext(int64_t submap_id);
  static std::optional<std::vector<WantedBlob>> WantedOf(const ShapeManifest& manifest,
                                                         const Shape& shape, bool with_tracks);
  void OnManifest(const std::shared_ptr<Pull>& pull, const Result<Bytes>& bytes);
  void FetchOfChunk(const std::shared_ptr<Pull>& pull, const WantedBlob& wanted);
  void OnPoints(const std::shared_ptr<Pull>& pull, size_t index, Result<Bytes> bytes);
  void OnTracks(const std::shared_ptr<Pull>& pull, size_t index, Result<Bytes> bytes);
  void OnPulled(const std::shared_ptr<Pull>& pull);
  void WatchPulls();
  void TellModels();

  Node& node_;
  ShapeStore& store_;
  const ShapeFollowerOptions options_;
  std::map<int64_t, submap_shape_t> newest_;        // by submap; not pulled yet
  std::map<int64_t, std::shared_ptr<Pull>> pulls_;  // by submap
  std::map<int64_t, std::string> told_models_;      // by submap: blob
  std::atomic<double> looked_s_;

  mutable std::mutex mutex_;
  std::map<int64_t, double> heard_s_;  // by submap; guarded by mutex_
  double wanted_since_s_ = 0;          // 0: they are not wanted; guarded by mutex_

  Bus::SubscriptionId subscription_ = 0;
  PollLoop::TimerId timer_ = 0;
  Alive alive_;
};

}  // namespace skein
