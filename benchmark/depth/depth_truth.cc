#include "benchmark/depth/depth_truth.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "benchmark/support/ply_mesh.h"

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

cv::Mat1b Textured(const cv::Mat1b& grey) {
  cv::Mat1f values, mean, squares;
  grey.convertTo(values, CV_32F);
  cv::boxFilter(values, mean, -1, {7, 7});
  cv::boxFilter(values.mul(values), squares, -1, {7, 7});
  return squares - mean.mul(mean) >= kTextured * kTextured;
}

double Share(size_t part, size_t all) {
  return all == 0 ? 0 : static_cast<double>(part) / static_cast<double>(all);
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

void DepthFigures::Add(const DepthMap& map, const cv::Mat1f& truth, const cv::Mat1b& grey) {
  const cv::Mat1b textured = Textured(grey);
  for (int y = 0; y < truth.rows; ++y) {
    for (int x = 0; x < truth.cols; ++x) {
      const float depth = map.depth(y, x), true_depth = truth(y, x);
      if (!(true_depth > 0)) {
        invented_ += depth > 0;
        continue;
      }
      ++surface_;
      textured_ += textured(y, x) != 0;
      if (!(depth > 0)) continue;
      ++found_;
      textured_found_ += textured(y, x) != 0;
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
  return {{"within_1_percent", Share(within_1, found_ + invented_)},
          {"within_2_percent", Share(within_2, found_ + invented_)},
          {"completeness", Share(found_, surface_)},
          {"completeness_textured", Share(textured_found_, textured_)},
          {"in_sky", Share(invented_, found_ + invented_)},
          {"median_error_gsd", Quantile(in_gsd, 0.5)},
          {"calibration", Calibration()}};
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
