// A pool of photos of a synthetic place, whose true surface is known. World frame: metres.
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "benchmark/support/photo_pool.h"
#include "clients/places/random.h"
#include "clients/sim/scenario.h"

namespace skein {

struct SyntheticPoolOptions {
  sim::ScenarioOptions scenario;  // its walks, of which each station is taken in four ways
  int width = 320, height = 240;
  std::string cache;  // folder for rendered photos
  int threads = 1;
};

class SyntheticPool : public PhotoPool {
 public:
  // Renders what the cache does not have. Throws std::runtime_error where it cannot be written.
  explicit SyntheticPool(const SyntheticPoolOptions& options);

  // One more photo of the place, from anywhere: its index. Not kept in the cache.
  int Add(const CameraPose& cam_from_world, int agent);

  // Samples of the true surface that some photo sees.
  const std::vector<SurfaceSample>& samples() const { return samples_; }
  const sim::Place& place() const { return place_; }

  // From less than 72 degrees off the sample's normal, with nothing in front.
  bool Shows(int photo, const SurfaceSample& sample) const override;

  // Corners of the photos are its points. A photo in which a point can be seen finds it with a
  // probability of 0.6 and an error of 0.5 px. Photos match a point where they see it from within
  // 30 degrees and from distances within a factor of two. A track is what matches connect, and its
  // point is triangulated. Poses are true.
  PoolMap MapOf(const std::vector<int>& taken) const override;
  int CommonPoints(int photo, const std::vector<int>& taken) const override;

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

  void PlanPhotos(const SyntheticPoolOptions& options);
  void RenderPhotos(const SyntheticPoolOptions& options);
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
  GuidedCamera camera_;  // of all photos
  sim::Camera sim_camera_;
  std::vector<sim::Pose> poses_;
  std::vector<TruePoint> points_;
  std::vector<std::vector<int>> points_of_photo_;
  std::vector<SurfaceSample> samples_;
};

}  // namespace skein
