// Dense points that skein-dense publishes: which there are. Chunks are pulled by whoever shows
// them.
#pragma once

#include <cstdint>
#include <functional>
#include <map>

#include "event_loop/alive.h"
#include "node/node.h"
#include "shapes/dense_store.h"

namespace skein {

// Keeps the newest manifest of each live submap in `store`. One pull a submap at a time; a pull of
// which nothing comes for 10 s gives way to the manifest that is published then. Loop's thread
// only.
class DenseFollower {
 public:
  using IsLive = std::function<bool(int64_t submap_id)>;
  // The store has other points of that submap.
  using OnPoints = std::function<void(int64_t submap_id, const DensePoints& points)>;

  DenseFollower(Node& node, DenseStore& store, IsLive is_live, OnPoints on_points);
  ~DenseFollower();
  DenseFollower(const DenseFollower&) = delete;
  DenseFollower& operator=(const DenseFollower&) = delete;

  // The submap has ended: a pull of its list is given up.
  void Drop(int64_t submap_id);

 private:
  struct Pull {
    BlobClient::FetchId fetch = 0;
    int64_t received_bytes = 0;
    double progress_s = 0;
  };

  void OnMessage(const dense_points_t& message);
  bool IsStalled(Pull* pull) const;
  void OnManifest(const dense_points_t& message, const Result<Bytes>& bytes);

  Node& node_;
  DenseStore& store_;
  const IsLive is_live_;
  const OnPoints on_points_;
  std::map<int64_t, Pull> pulls_;  // by submap
  uint64_t last_version_ = 0;
  Bus::SubscriptionId subscription_ = 0;
  Alive alive_;
};

}  // namespace skein
