#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "map/bundle_builder.h"
#include "map/scene_map.h"

namespace skein {

// Selects the part of a map that a new photo's local BA refines. One object serves one submap.
class LocalAdjustment {
 public:
  virtual ~LocalAdjustment() = default;

  virtual BundleRequest SelectWindow(const SceneMap& map, ImageId new_image) const = 0;

  // Whether the window leaves out points that its free images see. Such points are moved after the
  // BA, each by itself, to where their observations meet.
  virtual bool LeavesPointsOut() const { return false; }

  // Other photos with the distances of their global descriptors, 0 to 2.
  virtual void AddSimilar(ImageId id, const std::vector<std::pair<uint32_t, double>>& distances) {
    (void)id;
    (void)distances;
  }
};

using LocalAdjustmentMaker = std::function<std::shared_ptr<LocalAdjustment>()>;

// COLMAP's local BA, the default (incremental_mapper.cc, bundle_adjustment.cc of COLMAP 3.8). The
// window is the new image and those with most points in common with it. Two of them are held for
// the gauge. The new image's points are refined with all their observations, but for long tracks.
// Other points are constant when images outside observe them.
class ColmapWindow : public LocalAdjustment {
 public:
  // `num_images`: the new one included. COLMAP takes six.
  explicit ColmapWindow(int num_images = 30) : num_images_(num_images) {}
  BundleRequest SelectWindow(const SceneMap& map, ImageId new_image) const override;

 private:
  const int num_images_;
};

// How many of the points each registered image sees, most first, then by id.
std::vector<std::pair<ImageId, int>> RankObservers(const SceneMap& map,
                                                   const std::vector<Point3DId>& points);

}  // namespace skein
