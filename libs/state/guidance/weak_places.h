// Weak places, which photos may make better, and clusters of those that lie together. Inside of
// libs/state/guidance.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "guidance/quality.h"
#include "guidance/surfel_views.h"

namespace skein {

// A piece of surface that photos may make better: one that counts and has texture, or the unknown
// surface beyond a frontier (open_border).
struct Weak {
  Eigen::Vector3d position, normal;
  double area = 0;
  bool is_beyond = false;
  double min_cos = 0;  // a photo shows it if its direction's cosine with the normal is larger
  const Surfel* surfel = nullptr;        // whose photos show it; null: beyond a border none does
  double utility = 0;                    // with the photos that show it
  uint64_t version = 0;                  // of these
  std::vector<ViewOfSurfel> views = {};  // of these; of a piece filled when they are asked for
  std::shared_ptr<const AssessedViews> assessed = {};  // the same; of a piece alone
};

// Utility of a piece: 0 without photos, 1 if it is good. The first photos count a little: without
// them no further one makes it good.
double UtilityOf(double target_gsd, const SurfelQuality& quality);
// Utility of the unknown surface beyond a frontier, which closes with the second photo.
double UtilityOfBorder(size_t num_photos);

// Area that is not good, as a part of it.
inline double Missing(const Weak& weak) { return weak.area * (1 - weak.utility); }
// Whether a photo from there looks at its front.
bool Shows(const Eigen::Vector3d& centre, const Weak& weak);

// The result points into `place`.
std::vector<Weak> FindWeak(const PlaceQuality& place);

// Weak places near each other and facing one way, as one place to look at. A cluster stays where it
// is as its members become better.
struct Cluster {
  Eigen::Vector3d position = Eigen::Vector3d::Zero(), normal = Eigen::Vector3d::Zero();
  std::vector<uint32_t> members;  // weak places
};
std::vector<Cluster> ClusterWeak(const std::vector<Weak>& weak, double width);

// A cluster with weak members.
struct WeakCluster {
  const Cluster* cluster = nullptr;
  double missing = 0;             // area, of all members
  std::vector<uint32_t> weakest;  // of these the six that miss most, first
};
// The `max_num` clusters with the largest missing area, largest first.
std::vector<WeakCluster> FindWeakest(const std::vector<Weak>& weak,
                                     const std::vector<Cluster>& clusters, size_t max_num);

}  // namespace skein
