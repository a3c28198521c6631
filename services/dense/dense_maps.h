// Depth maps and dense points of photos, while their submaps grow.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "core/bytes.h"
#include "core/result.h"
#include "dense/confirmed_map.h"
#include "dense/sparse_scene.h"
#include "depth/dense_points.h"
#include "depth/depth_sweep.h"
#include "shapes/shape_store.h"

namespace skein {

// The next depth map.
struct DenseTask {
  uint32_t image_id = 0;
  std::vector<uint32_t> neighbours;  // best first: to be matched, and to confirm
  // Photos to give to SetPhoto before: the photo and those to be matched, as far as they are not
  // here.
  std::vector<uint32_t> wanted;
};

// A photo's points as they can be published.
struct DensePhotoPoints {
  struct Chunk {
    uint64_t id = 0;
    uint64_t version = 0;
    uint32_t num_points = 0;
    std::shared_ptr<const Bytes> bytes;  // EncodeShapeChunk, in the frame of formats/dense.h
    std::string blob_id;                 // of the bytes
  };
  double scale = 1;
  float share = 0;  // of the depth map's pixels that are a point
  std::vector<Chunk> chunks;
};

// Keeps for each photo its pixels, the depth map of a sweep (depth/depth_sweep.h), and the depths
// that other maps agree with (depth/consistency.h), all in the camera's frame. A bundle adjustment
// or a merge changes poses and the scale alone. So depth maps stay, also when a photo comes to
// another submap, unless the sparse points contradict one: then it is made again.
//
// One thread, but it may be another one for each call.
class DenseMaps {
 public:
  // on_progress: called between parts of a few seconds at most.
  DenseMaps(
      int size_px, int64_t max_bytes, std::function<void()> on_progress = [] {});
  ~DenseMaps();

  // The newest shape of a submap, with tracks.
  Status Update(const Shape& shape);
  void DropSubmap(int64_t submap_id);
  // The photo cannot be read, or failed too often: it gets no depth map and is nobody's neighbour.
  void LeaveOut(uint32_t image_id);

  // The newest photo without a depth map that has neighbours, else one whose map does not fit any
  // more, or has better neighbours by now. nullopt: nothing is to do until a shape comes.
  std::optional<DenseTask> Next();
  // The photo as its features were found in: unmirrored, of its camera's size or reduced
  // (PhotoTable).
  Status SetPhoto(uint32_t image_id, const cv::Mat3b& photo);
  // Makes the depth map of the task's photo and its points. The photos that it wanted and that did
  // not come are no neighbours.
  void Make(const DenseTask& task, int64_t utime_us);
  // A photo whose depths a new map may confirm: its points are to be worked out again. nullopt:
  // there is none.
  std::optional<uint32_t> NextToRefine();
  void Refine(uint32_t image_id, int64_t utime_us);

  // By image, of the submap's newest shape.
  std::map<uint32_t, DensePhotoPoints> PointsOfSubmap(int64_t submap_id) const;
  // By image: the depths that its points are of, with the pose of the submap's newest shape.
  std::map<uint32_t, ConfirmedMap> ConfirmedOf(int64_t submap_id) const;
  // Rises with each change of what PointsOfSubmap returns.
  uint64_t changes() const { return changes_; }
  // Photos in a map that have no depth map yet and may get one.
  size_t num_waiting() const;
  int64_t memory_bytes() const;

 private:
  struct Fit;
  struct Photo;

  static std::optional<Fit> FitOf(const DepthMap& map, const SparsePhoto& photo,
                                  const std::vector<Eigen::Vector3d>& points);
  void Leave(Photo* photo);
  void TakeOrphans();
  void EraseEmpty();
  void TakePose(const SparseScene& scene, int index, int64_t submap_id);
  void FitScale(const SparsePhoto& sparse, const std::vector<Eigen::Vector3d>& points,
                bool is_new_here, Photo* photo);
  bool IsWaiting(uint32_t image_id, const Photo& photo) const;
  bool IsOutdated(uint32_t image_id, const Photo& photo) const;
  bool HasMoved(uint32_t image_id, const Photo& photo, const Camera& camera) const;
  bool FindsBetterNeighbours(uint32_t image_id, Photo* photo) const;
  static std::vector<uint32_t> Matched(std::vector<uint32_t> neighbours);
  std::vector<uint32_t> NeighboursOf(const SparseScene& scene, uint32_t image_id) const;
  std::optional<DenseTask> TaskFor(uint32_t image_id, const Photo& photo) const;
  const PhotoTable& TableOf(const Camera& camera);
  std::set<uint32_t> Confirming(uint32_t image_id) const;
  bool MakeMap(const DenseTask& task);
  void Publish(uint32_t image_id, const std::vector<DensePoint>& points, int64_t utime_us,
               Photo* photo);
  void Forget();
  void ForgetPixels(uint32_t image_id, Photo* photo);

  const int size_px_;        // longer side of a depth map
  const int64_t max_bytes_;  // of depth maps and their photos
  const std::function<void()> on_progress_;
  DepthSweep sweep_;
  std::map<int64_t, SparseScene> scenes_;  // by submap
  std::map<uint32_t, Photo> photos_;       // by image
  std::optional<PhotoTable> table_;        // of table_camera_: there may be a camera a photo
  Camera table_camera_;
  std::set<uint32_t> left_out_;
  std::set<uint32_t> dirty_;    // whose points are to be worked out again
  std::set<uint32_t> no_task_;  // photos that can get no map before the next shape
  uint64_t changes_ = 0;
  int64_t clock_ = 0;  // of uses
};

}  // namespace skein
