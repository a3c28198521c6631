// The process that makes depth maps while photos are placed: follows the ledger and the map
// snapshots (shapes) of the submaps, and publishes dense points.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "blobs/blob_shelf.h"
#include "dense/dense_maps.h"
#include "dense/dense_options.h"
#include "dense/live_mesh.h"
#include "event_loop/failed_items.h"
#include "event_loop/worker_thread.h"
#include "formats/dense.h"
#include "node/ledger_follower.h"
#include "node/node.h"
#include "photo/photo_decoder.h"
#include "session/session_state.h"
#include "shapes/shape_follower.h"
#include "shapes/shape_store.h"

namespace skein {

// DenseService knows only what the ledger, the photos and the mappers tell, so it may die and
// return at any time: it then begins again. An exception, a crash or a hang counts against
// the photo, or against the mesh of the submap (event_loop/failed_items.h). Loop's thread; maps are
// made on another.
class DenseService {
 public:
  DenseService(Node& node, const DenseOptions& options);
  ~DenseService();
  DenseService(const DenseService&) = delete;
  DenseService& operator=(const DenseService&) = delete;

 private:
  using Blobs = std::map<std::string, BlobPtr>;
  // Points of a submap as they are published.
  struct Told {
    Bytes content = EncodeDenseManifest(DenseManifest());  // the list, without its version
    dense_points_t message{};
    Blobs blobs, previous;  // those before: somebody may be pulling them
  };
  struct Surface {
    std::map<uint32_t, DensePhotoPoints> points;  // by image
    SubmapMesh mesh;
  };
  // Surfaces of all submaps, by submap.
  struct Snapshot {
    uint64_t changes = 0;
    size_t num_waiting = 0;
    std::map<int64_t, Surface> surfaces;
  };
  // Photos of a task, which come one by one.
  struct Gathering {
    DenseTask task;
    size_t num_missing = 0;
    std::map<uint32_t, Result<Bytes>> photos;
  };
  // A step of the worker.
  struct Made {
    std::vector<uint32_t> failed;  // photos, for the first time or again
    double seconds = 0;
  };
  struct Plan {
    std::optional<DenseTask> task;
    std::vector<uint32_t> failed;
    std::vector<int64_t> failed_meshes;  // submaps
    bool goes_on = false;
  };

  ShapeFollowerOptions FollowShapes();
  void OnFact(const Fact& fact);
  void Go();
  void Gather(DenseTask task);
  void MakeMap(const std::shared_ptr<Gathering>& gathering);
  ShapePtr KnownPhotosOf(const Shape& shape) const;
  void OnPlan(const Plan& plan);
  void NoteFailures(const std::vector<uint32_t>& failed);
  void NoteFailedMeshes(const std::vector<int64_t>& failed);
  // On the worker.
  void Prepare();
  Plan MakePlan(const std::vector<ShapePtr>& shapes, const std::vector<int64_t>& live);
  Made Make(const Gathering& gathering);
  void LeaveOut(const std::vector<int64_t>& photos, const std::vector<int64_t>& meshes);
  bool GrowMesh(const std::vector<int64_t>& live, std::vector<int64_t>* failed);
  bool TryMesh(int64_t submap_id, const std::function<void()>& work, std::vector<int64_t>* failed);
  bool Try(const Step& step, const std::function<void()>& work);
  bool Decode(uint32_t image_id, const Bytes& photo);
  Snapshot MakeSnapshot(const std::vector<int64_t>& live, uint64_t told) const;
  // On the loop.
  void OnMade(const Made& made);
  void TakeSnapshot();
  void OnSnapshot(const Snapshot& snapshot);
  std::vector<int64_t> LiveSubmaps() const;
  void Tell(int64_t submap_id, const Surface& surface);
  void LogNew(const DenseManifest& manifest);
  void TellAgain();
  void Forget(int64_t submap_id);

  Node& node_;
  const DenseOptions options_;
  FailedItems failed_maps_, failed_meshes_;
  SessionState state_;
  ShapeStore store_;
  DenseMaps maps_;                                   // used by the worker
  LiveMesh mesh_;                                    // the same
  bool has_new_maps_ = false;                        // the same: what the mesh has not heard of
  std::unique_ptr<PhotoDecoder> decoder_;            // the same; its child is as nice as the worker
  std::set<int64_t> changed_, ended_;                // submaps that the worker is to hear of
  std::vector<int64_t> left_out_, meshes_left_out_;  // the same: photos, and submaps
  bool working_ = false;
  std::map<int64_t, Told> told_;  // by submap
  std::set<uint32_t> shown_;      // photos whose points were published
  uint64_t told_changes_ = 0;
  int64_t last_version_ = 0;
  size_t num_waiting_ = 0;
  int64_t num_done_ = 0;
  double sum_s_ = 0;
  std::vector<PollLoop::TimerId> timers_;
  std::unique_ptr<LedgerFollower> follower_;
  std::unique_ptr<ShapeFollower> shapes_;
  std::unique_ptr<WorkerThread> worker_;  // last: ends first
};

}  // namespace skein
