#include "benchmark/depth/depth_truth.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "benchmark/support/ply_mesh.h"
#include "core/angles.h"

namespace skein {
namespace {

constexpr double kTextured = 4;  // grey levels
constexpr int kBins = 10;

sim::Surface SurfaceOf(const std::vector<Eigen::Vector3f>& corners) {
  sim::Surface surface;
  if (corners.size() == 3) {
    surface.shape = sim::Surface::Shape::kGable;
    surface.right = corners[2] - corners[1];
    surface.origin = corners[0] - 0.5f * surface.right;
    surface.down = corners[1] - surface.origin;
    return surface;
  }
  surface.origin = corners[0];
  surface.down = corners[1] - corners[0];
  surface.right = corners[3] - corners[0];
  return surface;
}

float Quantile(std::vector<float> values, double part) {
  if (values.empty()) return 0;
  const auto at = values.begin() + static_cast<size_t>(part * (values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

}  // namespace

sim::Scene ReadSurfaces(const std::string& file) {
  const PlyMesh mesh = ReadPlyMesh(file);
  std::vector<sim::Surface> surfaces;
  for (const std::vector<uint32_t>& face : mesh.faces) {
    if (face.size() > 4) break;
    std::vector<Eigen::Vector3f> corners;
    for (const uint32_t index : face) corners.push_back(mesh.vertices[index].cast<float>());
    surfaces.push_back(SurfaceOf(corners));
  }
  if (surfaces.empty() || surfaces.size() != mesh.faces.size()) {
    throw std::runtime_error(file + " is not one of skein sim's surfaces.ply");
  }
  return sim::Scene(surfaces);
}

cv::Mat1f TrueDepth(const sim::Scene& scene, const DepthCamera& camera, const DepthPose& pose) {
  cv::Mat1f depth(camera.height, camera.width, 0.0f);
  const Eigen::Vector3f centre = pose.Centre().cast<float>();
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const Eigen::Vector2d ray = camera.Ray({x + 0.5, y + 0.5});
      const Eigen::Vector3d direction = pose.rotation.transpose() * ray.homogeneous();
      const sim::Hit hit = scene.Trace(centre, direction.cast<float>());
      if (hit.surface >= 0) depth(y, x) = hit.t;
    }
  }
  return depth;
}

cv::Mat1b Textured(const cv::Mat1b& grey) {
  cv::Mat1f values, mean, squares;
  grey.convertTo(values, CV_32F);
  cv::boxFilter(values, mean, -1, {7, 7});
  cv::boxFilter(values.mul(values), squares, -1, {7, 7});
  return squares - mean.mul(mean) >= kTextured * kTextured;
}

Eigen::Vector3d TruePlace::Point(int photo, int x, int y, float depth) const {
  const DepthPhoto& of = photos_[photo];
  return of.cam_from_world.ToWorld(depth * of.camera.Ray({x + 0.5, y + 0.5}).homogeneous());
}

bool TruePlace::Sees(int photo, const Eigen::Vector3d& point) const {
  constexpr float kBeforePoint = 1 - 1e-3f;  // of the way to it
  const DepthPhoto& by = photos_[photo];
  const Eigen::Vector3d in_camera = by.cam_from_world.ToCamera(point);
  if (in_camera.z() <= 0) return false;
  const Eigen::Array2d pixel = by.camera.Pixel(in_camera.hnormalized());
  const Eigen::Array2d size(by.camera.width, by.camera.height);
  if ((pixel < 0).any() || (pixel >= size).any()) return false;
  const Eigen::Vector3d centre = by.cam_from_world.Centre();
  return !scene_.Occluded(centre.cast<float>(), (point - centre).cast<float>(), kBeforePoint);
}

bool TruePlace::SeesToo(int photo, int other, const Eigen::Vector3d& point) const {
  constexpr double kMinAngle = 1, kMaxAngle = 45;  // degrees
  const Eigen::Vector3d here = photos_[photo].cam_from_world.Centre() - point;
  const Eigen::Vector3d there = photos_[other].cam_from_world.Centre() - point;
  const double degrees = RadToDeg(std::atan2(here.cross(there).norm(), here.dot(there)));
  return degrees >= kMinAngle && degrees <= kMaxAngle && Sees(other, point);
}

bool TruePlace::IsSeenByThree(int photo, const Eigen::Vector3d& point) const {
  int count = 0;
  for (int other = 0; other < static_cast<int>(photos_.size()) && count < 2; ++other) {
    count += other != photo && SeesToo(photo, other, point);
  }
  return count == 2;
}

cv::Mat1b TruePlace::SeenByThree(int photo, const cv::Mat1f& truth) const {
  cv::Mat1b seen(truth.size(), uint8_t{0});
  for (int y = 0; y < truth.rows; ++y) {
    for (int x = 0; x < truth.cols; ++x) {
      if (!(truth(y, x) > 0)) continue;
      if (IsSeenByThree(photo, Point(photo, x, y, truth(y, x)))) seen(y, x) = 255;
    }
  }
  return seen;
}

void DepthFigures::Add(const DepthMap& map, const cv::Mat1f& truth, const cv::Mat1b& grey,
                       const cv::Mat1b& seen) {
  const cv::Mat1b textured = Textured(grey);
  for (int y = 0; y < truth.rows; ++y) {
    for (int x = 0; x < truth.cols; ++x) {
      const float depth = map.depth(y, x), true_depth = truth(y, x);
      const bool is_found = depth > 0, is_seen = !seen.empty() && seen(y, x) != 0;
      if (!(true_depth > 0)) {
        invented_ += is_found;
        continue;
      }
      surface_.Add(is_found);
      if (textured(y, x) != 0) textured_.Add(is_found);
      if (is_seen) seen_.Add(is_found);
      if (is_seen && textured(y, x) != 0) seen_textured_.Add(is_found);
      if (!is_found) continue;
      samples_.push_back({map.error(y, x), std::abs(depth - true_depth),
                          true_depth / static_cast<float>(map.camera.focal_px.x()), true_depth});
    }
  }
}

nlohmann::json DepthFigures::ToJson() const {
  std::vector<float> in_gsd;
  size_t within_1 = 0, within_2 = 0;
  for (const Sample& s : samples_) {
    in_gsd.push_back(s.error / s.gsd);
    within_1 += s.error <= 0.01f * s.depth;
    within_2 += s.error <= 0.02f * s.depth;
  }
  const double found = static_cast<double>(std::max<size_t>(1, samples_.size() + invented_));
  nlohmann::json out = {{"within_1_percent", static_cast<double>(within_1) / found},
                        {"within_2_percent", static_cast<double>(within_2) / found},
                        {"completeness", surface_.Value()},
                        {"completeness_textured", textured_.Value()},
                        {"in_sky", static_cast<double>(invented_) / found},
                        {"median_error_gsd", Quantile(in_gsd, 0.5)},
                        {"calibration", Calibration()}};
  if (seen_.all > 0) {
    out["completeness_seen"] = seen_.Value();
    out["completeness_textured_seen"] = seen_textured_.Value();
  }
  return out;
}

nlohmann::json DepthFigures::Calibration() const {
  std::vector<Sample> sorted = samples_;
  std::sort(sorted.begin(), sorted.end(), [](const Sample& a, const Sample& b) {
    return a.predicted / a.depth < b.predicted / b.depth;
  });
  nlohmann::json bins = nlohmann::json::array();
  double xx = 0, xy = 0;
  for (int i = 0; i < kBins; ++i) {
    std::vector<float> predicted, errors;
    for (size_t k = sorted.size() * i / kBins; k < sorted.size() * (i + 1) / kBins; ++k) {
      predicted.push_back(100 * sorted[k].predicted / sorted[k].depth);
      errors.push_back(100 * sorted[k].error / sorted[k].depth);
    }
    const double x = Quantile(predicted, 0.5), y = Quantile(errors, 0.68);
    xx += x * x;
    xy += x * y;
    bins.push_back({x, y});
  }
  return {{"predicted_and_true_percent", bins}, {"slope", xx > 0 ? xy / xx : 0}};
}

}  // namespace skein
