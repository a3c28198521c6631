// A pool of real photos, of a COLMAP model that was made of all of them. Frame and unit: the
// model's.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "benchmark/support/photo_pool.h"
#include "benchmark/support/undistortion.h"
#include "sfm/reconstruction.h"

namespace skein {

struct ModelPoolOptions {
  std::string model;   // folder: cameras, images and points3D, .bin or .txt
  std::string images;  // folder that the names of the model's images lie in
  int width = 400;     // of the longer side of a photo as it is matched
  int threads = 1;
};

class ModelPool : public PhotoPool {
 public:
  // The model's registered photos in the order of their names, without distortion; the agent is
  // the folder in the name. Throws std::runtime_error where there is no model, or a photo is
  // missing, is not of its camera's size, or can't be freed of its distortion.
  explicit ModelPool(const ModelPoolOptions& options);

  // Occlusion is not known: surfaces in front do not count.
  bool Shows(int photo, const SurfaceSample& sample) const override;

  // The model restricted to `taken`: a point stays where two of these observe it 1.5 degrees
  // apart. Its place stays that of the whole model; who observes it and its error are of `taken`.
  PoolMap MapOf(const std::vector<int>& taken) const override;
  // Points that MapOf would have without the photo, and that the photo observes.
  int CommonPoints(int photo, const std::vector<int>& taken) const override;

  size_t num_points() const { return points_.size(); }
  // Observations of the model that lie outside of the photos without distortion: left out.
  size_t num_left_out() const { return num_left_out_; }

 private:
  struct Observation {
    int photo;
    Eigen::Vector2d pixel;  // without distortion
  };
  struct Point {
    Eigen::Vector3d xyz;
    std::vector<Observation> observations;  // of one photo one
  };

  void AddPhotos(const Reconstruction& model, const ModelPoolOptions& options);
  void AddPoints(const Reconstruction& model);
  // Adds an observation to the last point. If a photo observes the point twice, the first
  // observation counts.
  void AddObservation(int photo, const Eigen::Vector2d& original);
  double ErrorOf(const Observation& observation, const Eigen::Vector3d& xyz) const;
  // Whether two of the photos see the point 1.5 degrees apart.
  bool HasParallax(const Eigen::Vector3d& xyz, const std::vector<int>& photos) const;

  std::vector<Undistortion> undistortions_;  // in the order of cameras_
  std::vector<Point> points_;
  std::vector<std::vector<int>> points_of_photo_;
  size_t num_left_out_ = 0;
};

}  // namespace skein
