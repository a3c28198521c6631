#include "depth/depth_regions.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <random>
#include <utility>
#include <vector>

namespace skein {
namespace {

constexpr double kMarginPx = 6;        // of the search, at each end of a region's planes
constexpr double kLeastSearchPx = 31;  // of a region's planes, at least
constexpr double kOffRegion = 0.01;    // part of a region's coarse depths, at each end
constexpr double kMinKnown = 0.1;      // part of a region's coarse pixels that have a depth
// The plane of a region (RANSAC): pixels of the search by which a depth may be off it, the part of
// the depths that lie on it, how many are looked at, and in how many triples.
constexpr double kOnPlanePx = 1.5;
constexpr double kMinOnPlane = 0.25;
constexpr size_t kMaxSamples = 400;
constexpr int kTriples = 50;

// A coarse depth: ray and inverse depth.
struct Sample {
  Eigen::Vector2d ray;
  double inverse = 0;
};

// Inverse depth = plane . (ray, 1).
std::optional<Eigen::Vector3d> PlaneThrough(const Sample& a, const Sample& b, const Sample& c) {
  Eigen::Matrix3d rows;
  rows << a.ray.homogeneous().transpose(), b.ray.homogeneous().transpose(),
      c.ray.homogeneous().transpose();
  if (std::abs(rows.determinant()) < 1e-9) return std::nullopt;
  return rows.inverse() * Eigen::Vector3d(a.inverse, b.inverse, c.inverse);
}

bool IsOn(const Eigen::Vector3d& plane, const Sample& sample, double most) {
  return std::abs(plane.dot(sample.ray.homogeneous()) - sample.inverse) <= most;
}

Eigen::Vector3d Refined(const Eigen::Vector3d& plane, const std::vector<Sample>& samples,
                        double most) {
  Eigen::Matrix3d a = Eigen::Matrix3d::Identity() * 1e-12;
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  for (const Sample& sample : samples) {
    if (!IsOn(plane, sample, most)) continue;
    const Eigen::Vector3d ray = sample.ray.homogeneous();
    a += ray * ray.transpose();
    b += sample.inverse * ray;
  }
  return a.ldlt().solve(b);
}

// The slope of the plane that most samples lie on; 0 without such a plane.
Eigen::Vector2d SlopeOf(const std::vector<Sample>& samples, double most) {
  std::mt19937 random(1);
  const auto pick = [&]() -> const Sample& { return samples[random() % samples.size()]; };
  std::ptrdiff_t best =
      static_cast<std::ptrdiff_t>(kMinOnPlane * static_cast<double>(samples.size()));
  Eigen::Vector3d plane = Eigen::Vector3d::Zero();
  for (int i = 0; i < kTriples; ++i) {
    const auto through = PlaneThrough(pick(), pick(), pick());
    if (!through) continue;
    const auto count = std::count_if(samples.begin(), samples.end(), [&](const Sample& sample) {
      return IsOn(*through, sample, most);
    });
    if (count <= best) continue;
    best = count;
    plane = *through;
  }
  if (plane.isZero()) return Eigen::Vector2d::Zero();
  return Refined(plane, samples, most).head<2>();
}

cv::Rect InCoarse(const cv::Rect& area, cv::Size photo, cv::Size coarse) {
  const double x = static_cast<double>(coarse.width) / photo.width;
  const double y = static_cast<double>(coarse.height) / photo.height;
  const cv::Point first(static_cast<int>(area.x * x) - 1, static_cast<int>(area.y * y) - 1);
  const cv::Point last(static_cast<int>(area.br().x * x) + 2,
                       static_cast<int>(area.br().y * y) + 2);
  return cv::Rect(first, last) & cv::Rect(cv::Point(), coarse);
}

class Quadtree {
 public:
  Quadtree(const DepthPhoto& photo, const DepthMap& coarse, const SweepPlanes& whole,
           double most_px, const RegionSearch& search_px)
      : photo_(photo), coarse_(coarse), whole_(whole), most_px_(most_px), search_px_(search_px) {}

  void Add(const cv::Rect& area) {
    const DepthRegion region = RegionOf(area);
    const bool is_small = std::min(area.width, area.height) < 2 * kMinRegionPx;
    if (is_small || search_px_(region) <= most_px_) return regions_.push_back(region);
    const cv::Point middle = (area.tl() + area.br()) / 2;
    for (const cv::Point corner :
         {area.tl(), cv::Point(area.br().x, area.y), cv::Point(area.x, area.br().y), area.br()}) {
      Add(cv::Rect(corner, middle));
    }
  }

  std::vector<DepthRegion> Take() { return std::move(regions_); }

 private:
  DepthRegion RegionOf(const cv::Rect& area) const {
    const cv::Rect there = InCoarse(area, photo_.grey.size(), coarse_.depth.size());
    std::vector<Sample> samples = SamplesIn(there);
    if (static_cast<double>(samples.size()) <= kMinKnown * there.area()) return {area, whole_};
    const double search = search_px_({area, whole_});
    if (search < kLeastSearchPx) return {area, whole_};
    const double px = (whole_.last - whole_.first) / search;
    SweepPlanes planes;
    planes.centre = photo_.camera.Ray({area.x + area.width / 2.0, area.y + area.height / 2.0});
    planes.slope = SlopeOf(Thinned(samples), kOnPlanePx * px);
    SetEnds(samples, px, &planes);
    return {area, planes};
  }

  std::vector<Sample> SamplesIn(const cv::Rect& there) const {
    std::vector<Sample> samples;
    for (int y = there.y; y < there.br().y; ++y) {
      for (int x = there.x; x < there.br().x; ++x) {
        const float depth = coarse_.depth(y, x);
        if (depth > 0) samples.push_back({coarse_.camera.Ray({x + 0.5, y + 0.5}), 1 / depth});
      }
    }
    return samples;
  }

  static std::vector<Sample> Thinned(const std::vector<Sample>& samples) {
    std::vector<Sample> some;
    const size_t step = samples.size() / kMaxSamples + 1;
    for (size_t i = 0; i < samples.size(); i += step) some.push_back(samples[i]);
    return some;
  }

  // px: inverse depth of a pixel of the search.
  static void SetEnds(const std::vector<Sample>& samples, double px, SweepPlanes* planes) {
    std::vector<double> at_centre;
    for (const Sample& sample : samples) {
      at_centre.push_back(sample.inverse - planes->InverseDepth(sample.ray, 0));
    }
    std::sort(at_centre.begin(), at_centre.end());
    const auto outliers = static_cast<size_t>(kOffRegion * static_cast<double>(samples.size()));
    const double low = at_centre[outliers], high = at_centre[at_centre.size() - 1 - outliers];
    const double margin = std::max(kMarginPx * px, (kLeastSearchPx * px - (high - low)) / 2);
    planes->first = low - margin;
    planes->last = high + margin;
  }

  const DepthPhoto& photo_;
  const DepthMap& coarse_;
  const SweepPlanes& whole_;
  const double most_px_;
  const RegionSearch& search_px_;
  std::vector<DepthRegion> regions_;
};

}  // namespace

DepthPhoto Halved(const DepthPhoto& photo) {
  DepthPhoto half{{}, {}, photo.camera, photo.cam_from_world};
  DepthCamera& camera = half.camera;
  camera.width = (photo.camera.width + 1) / 2;
  camera.height = (photo.camera.height + 1) / 2;
  const Eigen::Vector2d scale(static_cast<double>(camera.width) / photo.camera.width,
                              static_cast<double>(camera.height) / photo.camera.height);
  camera.focal_px = camera.focal_px.cwiseProduct(scale);
  camera.principal_point_px = camera.principal_point_px.cwiseProduct(scale);
  const cv::Size size(camera.width, camera.height);
  cv::resize(photo.grey, half.grey, size, 0, 0, cv::INTER_AREA);
  if (photo.valid.empty()) return half;
  cv::resize(photo.valid, half.valid, size, 0, 0, cv::INTER_AREA);
  half.valid = half.valid == 255;
  return half;
}

DepthPhoto Cropped(const DepthPhoto& photo, const cv::Rect& area) {
  DepthPhoto part{photo.grey(area), photo.valid.empty() ? cv::Mat1b() : photo.valid(area),
                  photo.camera, photo.cam_from_world};
  part.camera.width = area.width;
  part.camera.height = area.height;
  part.camera.principal_point_px -= Eigen::Vector2d(area.x, area.y);
  return part;
}

std::vector<DepthRegion> RegionsOf(const DepthPhoto& photo, const DepthMap& coarse,
                                   const SweepPlanes& whole, double most_px,
                                   const RegionSearch& search_px) {
  Quadtree tree(photo, coarse, whole, most_px, search_px);
  tree.Add(cv::Rect(cv::Point(), photo.grey.size()));
  return tree.Take();
}

}  // namespace skein
