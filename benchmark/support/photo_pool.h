// Many photos of a place, to choose from: each one's pose and pixels, and the map that a structure
// from motion would make of some of them. synthetic_pool.h and model_pool.h make pools.
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <vector>

#include "guidance/guided_map.h"

namespace skein {

// A piece of surface that coverage is counted on.
struct SurfaceSample {
  Eigen::Vector3d xyz = Eigen::Vector3d::Zero();
  // Unit, towards a photo that sees it; zero: not known.
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
};

// The first one in each cube of this width: as many a square metre everywhere.
std::vector<SurfaceSample> ThinOut(const std::vector<SurfaceSample>& samples, double width);

// A map of some photos of a pool. `map.photos` is in the order of `taken`.
struct PoolMap {
  std::vector<int> taken;  // index into the pool, of each photo
  GuidedMap map;
  std::vector<double> error_px;  // of each point: mean reprojection error
};

class PhotoPool {
 public:
  virtual ~PhotoPool() = default;

  int size() const { return static_cast<int>(photos_.size()); }
  // In the order in which a person takes them: walk after walk. `agent` is the walk.
  const GuidedPhoto& photo(int i) const { return photos_[i]; }
  const GuidedCamera& camera(int i) const { return cameras_[photos_[i].camera]; }
  // As the camera has it: without distortion.
  const cv::Mat1f& grey(int i) const { return greys_[i]; }

  // Whether the photo has the place in view; with nothing in front, where the pool knows.
  virtual bool Shows(int photo, const SurfaceSample& sample) const = 0;
  // Whether two of these photos show it at up to max_gsd (Completeness): it counts.
  bool Counts(const std::vector<int>& photos, const SurfaceSample& sample, double max_gsd) const;

  virtual PoolMap MapOf(const std::vector<int>& taken) const = 0;
  // Points that the photo has in common with the map of `taken`, which need not be made for it.
  virtual int CommonPoints(int photo, const std::vector<int>& taken) const = 0;
  // Photos of `taken` that find 30 common points with the ones before, in this order. The first two
  // are taken for granted. A photo that fails is tried again after each one that does not.
  std::vector<int> Registered(const std::vector<int>& taken) const;

 protected:
  static constexpr double kMinParallaxDeg = 1.5;  // of a point

  // Photos without points: MapOf begins with it.
  PoolMap EmptyMapOf(const std::vector<int>& taken) const;
  // For each photo of the pool its place in `taken`, or -1.
  std::vector<int> PlacesIn(const std::vector<int>& taken) const;

  std::vector<GuidedCamera> cameras_;
  std::vector<GuidedPhoto> photos_;
  std::vector<cv::Mat1f> greys_;
};

}  // namespace skein
