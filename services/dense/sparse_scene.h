// A submap's map snapshot (shape) as depth maps are made from it.
#pragma once

#include <cstdint>
#include <map>
#include <unordered_map>
#include <vector>

#include "core/result.h"
#include "depth/neighbours.h"
#include "depth/photo_table.h"
#include "formats/shape.h"
#include "sfm/camera.h"
#include "shapes/shape_store.h"

namespace skein {

// Photos whose numbers make no sense (a pose that is not finite, a camera of an unknown model) are
// left out.
class SparseScene {
 public:
  // Only chunks with another version are decoded. On failure the scene is empty.
  Status Update(const Shape& shape);

  // By index, ascending by image id.
  const std::vector<uint32_t>& image_ids() const { return image_ids_; }
  const std::vector<SparsePhoto>& photos() const { return photos_; }
  const Camera& CameraOf(int index) const { return cameras_.at(camera_ids_[index]); }
  // The points of all photos: SparsePhoto::points are indices into them.
  const std::vector<Eigen::Vector3d>& points() const { return points_; }
  // -1: there is no such photo.
  int Find(uint32_t image_id) const;

 private:
  struct Chunk {
    uint64_t version = 0;
    std::vector<Eigen::Vector3d> points;
    PointTracks tracks;
  };

  void TakePhotos(const Shape& shape);
  Status TakeChunks(const Shape& shape);
  void TakePoints();

  std::map<uint32_t, Camera> cameras_;
  std::vector<uint32_t> image_ids_, camera_ids_;  // of each photo
  std::vector<SparsePhoto> photos_;
  std::vector<Eigen::Vector3d> points_;
  std::unordered_map<uint32_t, int> index_of_;  // by image id
  std::map<uint64_t, Chunk> chunks_;            // by id
};

}  // namespace skein
