// Many photos of a synthetic place, to choose from: each one's pose, its pixels when they are
// wanted, and the map that a structure from motion would make of some of them. World frame: metres.
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "clients/sim/random.h"
#include "clients/sim/scenario.h"
#include "guidance/guided_map.h"

namespace skein {

struct PoolOptions {
  sim::ScenarioOptions scenario;  // its walks, of which each station is taken in four ways
  int width = 320, height = 240;
  std::string cache;  // folder for rendered photos
  int threads = 1;
};

// A piece of true surface that a photo of the pool sees.
struct TrueSample {
  Eigen::Vector3d xyz = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  // unit, towards the photo
};

// A map of some photos of a pool. `map.photos` is in the order of `taken`.
struct PoolMap {
  std::vector<int> taken;  // index into the pool, of each photo
  GuidedMap map;
  std::vector<double> error_px;  // of each point: mean reprojection error
};

class PhotoPool {
 public:
  // Renders what the cache does not have. Throws std::runtime_error where it cannot be written.
  explicit PhotoPool(const PoolOptions& options);

  // One more photo of the place, from anywhere: its index. Not kept in the cache.
  int Add(const CameraPose& cam_from_world, int agent);

  int size() const { return static_cast<int>(photos_.size()); }
  const GuidedCamera& camera() const { return camera_; }
  // In the order in which a person takes them: walk after walk. `agent` is the walk.
  const GuidedPhoto& photo(int i) const { return photos_[i]; }
  const cv::Mat1f& grey(int i) const { return greys_[i]; }
  const std::vector<TrueSample>& samples() const { return samples_; }
  const sim::Place& place() const { return place_; }

  // Whether the photo has the place in view, from less than 72 degrees off its normal and with
  // nothing in front.
  bool Shows(int photo, const Eigen::Vector3d& xyz, const Eigen::Vector3d& normal) const;

  // Corners of the photos are its points. A photo in which a point can be seen finds it with a
  // probability of 0.6 and an error of 0.5 px. Photos match a point where they see it from within
  // 30 degrees and from distances within a factor of two. A track is what matches connect, and its
  // point is triangulated. Poses are true.
  PoolMap MapOf(const std::vector<int>& taken) const;
  // Points that the photo has in common with the map of `taken`, which need not be made for it.
  int CommonPoints(int photo, const std::vector<int>& taken) const;
  // Those of `taken` that find 30 common points with the ones before, in this order. The first
  // two are taken for granted. Who fails is tried again after each one that does not.
  std::vector<int> Registered(const std::vector<int>& taken) const;

 private:
  struct Observation {
    int photo;
    Eigen::Vector2d pixel;      // with its error
    Eigen::Vector3d direction;  // unit, from the true point to the camera
    double distance;
  };
  using Observations = std::vector<Observation>;  // of one true point, ascending photos
  struct TruePoint {
    Eigen::Vector3d xyz, normal;
    Observations observations;
  };

  void PlanPhotos(const PoolOptions& options);
  void RenderPhotos(const PoolOptions& options);
  cv::Mat1b Render(int photo) const;
  void FindPoints(int threads);
  void TakeSamples();
  std::vector<TruePoint> PointsAtCorners(int photo) const;
  // False where the photo does not see or find the point.
  bool Observe(int photo, sim::Random* random, TruePoint* point) const;
  void AddPoints(std::vector<TruePoint> points);
  bool Matched(const Observation& a, const Observation& b) const;
  // Tracks of a point: sets of observations among the taken photos.
  std::vector<Observations> TracksOf(const Observations& all,
                                     const std::vector<int>& place_of_photo) const;
  void AddPoint(const Observations& track, const std::vector<int>& place_of_photo,
                PoolMap* map) const;

  sim::Place place_;
  GuidedCamera camera_;
  sim::Camera sim_camera_;
  std::vector<GuidedPhoto> photos_;
  std::vector<sim::Pose> poses_;
  std::vector<cv::Mat1f> greys_;
  std::vector<TruePoint> points_;
  std::vector<std::vector<int>> points_of_photo_;
  std::vector<TrueSample> samples_;
};

}  // namespace skein
