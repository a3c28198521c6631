#include "disambiguation/twin_check.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/projection.h"

namespace skein {
namespace {

using colmap::image_t;

constexpr double kRadPerDeg = 3.14159265358979323846 / 180.0;

struct Region {
  int num_predicted = 0;
  int num_observed = 0;
  int num_keypoints = 0;
};

class Side {
 public:
  Side(const colmap::Reconstruction& model, const std::set<image_t>& shared,
       const TwinOptions& options)
      : model_(model), options_(options) {
    for (const image_t id : model.RegImageIds()) {
      if (!shared.count(id)) own_centres_[id] = model.Image(id).ProjectionCenter();
    }
  }

  std::vector<Region> RegionsOf(image_t id) const {
    const colmap::Image& image = model_.Image(id);
    std::vector<Region> regions(options_.num_columns * options_.num_rows);
    for (const colmap::Point2D& point2D : image.Points2D()) {
      const int index = IndexOf(image, point2D.XY());
      if (index >= 0) ++regions[index].num_keypoints;
    }
    const Eigen::Matrix3x4d projection = image.ProjectionMatrix();
    const Eigen::Vector3d centre = image.ProjectionCenter();
    for (const auto& [unused, point] : model_.Points3D()) {
      const int index = RegionOf(image, projection, point.XYZ());
      if (index < 0 || !SeenAlike(id, centre, point)) continue;
      ++regions[index].num_predicted;
      regions[index].num_observed += Observes(id, point);
    }
    return regions;
  }

  // `usual_share`: of the predicted points that photos of this side observe.
  RegionStatistics Summarise(const std::vector<Region>& regions, double usual_share) const {
    RegionStatistics statistics;
    for (const Region& region : regions) {
      if (region.num_predicted < options_.min_points_per_region) continue;
      if (region.num_keypoints < options_.min_points_per_region) continue;
      ++statistics.num_regions;
      statistics.num_predicted += region.num_predicted;
      statistics.num_observed += region.num_observed;
      statistics.num_empty +=
          region.num_observed < options_.empty_share * usual_share * region.num_predicted;
    }
    return statistics;
  }

 private:
  int IndexOf(const colmap::Image& image, const Eigen::Vector2d& pixel) const {
    const colmap::Camera& camera = model_.Camera(image.CameraId());
    const double x = pixel.x() / camera.Width();
    const double y = pixel.y() / camera.Height();
    if (!(x >= 0 && x < 1 && y >= 0 && y < 1)) return -1;
    return static_cast<int>(y * options_.num_rows) * options_.num_columns +
           static_cast<int>(x * options_.num_columns);
  }

  int RegionOf(const colmap::Image& image, const Eigen::Matrix3x4d& projection,
               const Eigen::Vector3d& xyz) const {
    const Eigen::Vector3d in_camera = projection * xyz.homogeneous();
    // A wide view angle is left out: distortion models fold back there.
    if (in_camera.z() <= 0 || in_camera.head<2>().norm() > 2 * in_camera.z()) return -1;
    const colmap::Camera& camera = model_.Camera(image.CameraId());
    return IndexOf(image, camera.WorldToImage(in_camera.hnormalized()));
  }

  // Another photo, and one of this side alone, observes the point from about the same direction and
  // distance. What shared photos see among themselves says nothing about the place they are in.
  bool SeenAlike(image_t id, const Eigen::Vector3d& centre, const colmap::Point3D& point) const {
    const Eigen::Vector3d ray = centre - point.XYZ();
    const double min_cos = std::cos(options_.max_view_angle_deg * kRadPerDeg);
    for (const colmap::TrackElement& element : point.Track().Elements()) {
      const auto it = own_centres_.find(element.image_id);
      if (element.image_id == id || it == own_centres_.end()) continue;
      const Eigen::Vector3d other = it->second - point.XYZ();
      const double ratio = ray.norm() / other.norm();
      if (ratio > options_.max_scale_ratio || ratio < 1 / options_.max_scale_ratio) continue;
      if (ray.dot(other) >= min_cos * ray.norm() * other.norm()) return true;
    }
    return false;
  }

  static bool Observes(image_t id, const colmap::Point3D& point) {
    for (const colmap::TrackElement& element : point.Track().Elements()) {
      if (element.image_id == id) return true;
    }
    return false;
  }

  const colmap::Reconstruction& model_;
  const TwinOptions& options_;
  EIGEN_STL_UMAP(image_t, Eigen::Vector3d) own_centres_;  // of photos that are not shared
};

// Photos of the side that are not shared, evenly spread over the list.
std::vector<image_t> ReferenceImages(const colmap::Reconstruction& model,
                                     const std::set<image_t>& shared, int max_images) {
  std::vector<image_t> own;
  for (const image_t id : model.RegImageIds()) {
    if (!shared.count(id)) own.push_back(id);
  }
  const size_t step = std::max<size_t>(1, own.size() / max_images);
  std::vector<image_t> chosen;
  for (size_t i = 0; i < own.size(); i += step) chosen.push_back(own[i]);
  return chosen;
}

double EmptyShare(const RegionStatistics& statistics) {
  return static_cast<double>(statistics.num_empty) / std::max(1, statistics.num_regions);
}

struct Usual {
  double observed_share = 0.0;
  double empty_share = 0.0;
};

Usual UsualOf(const Side& side, const std::vector<image_t>& images) {
  std::vector<std::vector<Region>> regions;
  RegionStatistics sum;
  for (const image_t id : images) {
    regions.push_back(side.RegionsOf(id));
    const RegionStatistics one = side.Summarise(regions.back(), 0);
    sum.num_predicted += one.num_predicted;
    sum.num_observed += one.num_observed;
  }
  Usual usual;
  usual.observed_share = sum.num_observed / std::max(1.0, 1.0 * sum.num_predicted);
  for (const auto& of_image : regions) {
    const RegionStatistics one = side.Summarise(of_image, usual.observed_share);
    sum.num_regions += one.num_regions;
    sum.num_empty += one.num_empty;
  }
  usual.empty_share = EmptyShare(sum);
  return usual;
}

std::string CheckSide(const std::string& name, const colmap::Reconstruction& model,
                      const std::set<image_t>& shared, const TwinOptions& options) {
  const Side side(model, shared, options);
  const Usual usual = UsualOf(side, ReferenceImages(model, shared, options.max_reference_images));
  int num_images = 0, num_suspicious = 0;
  for (const image_t id : shared) {
    const RegionStatistics one = side.Summarise(side.RegionsOf(id), usual.observed_share);
    if (one.num_regions < options.min_regions) continue;
    ++num_images;
    num_suspicious += EmptyShare(one) > usual.empty_share + options.max_empty_regions;
  }
  if (num_images < options.min_images || 2 * num_suspicious <= num_images) return "";
  return std::to_string(num_suspicious) + " of " + std::to_string(num_images) +
         " shared images miss most of what the " + name + " predicts: look-alike places";
}

}  // namespace

std::string FindTwins(const colmap::Reconstruction& target, const colmap::Reconstruction& source,
                      const std::set<image_t>& shared, const TwinOptions& options) {
  const std::string missing = CheckSide("target", target, shared, options);
  return missing.empty() ? CheckSide("source", source, shared, options) : missing;
}

}  // namespace skein
