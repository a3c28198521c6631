#include "guidance/place_scale.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "core/statistics.h"

namespace skein {
namespace {

constexpr size_t kMaxSamples = 10'000;

// A surfel's cell is as wide as makes this many points in it, were a photo's points spread evenly;
// of the median photo. So weakly textured places have wide cells.
constexpr double kPointsPerCell = 4;
constexpr double kMinCellPx = 24;      // as wide at least in the median photo,
constexpr double kMaxCellShare = 0.1;  // and at most this part of the photo's width

// Of a part's cell: then a plane has nine points in and around it, and kMinPointsOfNormal are there
// in 88 % of the cells where points lie at random (Poisson).
constexpr double kPointsPerPart = 1;
// A window of dense matching tells nothing of what is smaller than itself (7 x 7 pixels in
// benchmark/support/plane_sweep.h; 5 x 5 to 11 x 11 are usual).
constexpr double kMinPartPx = 7;

struct Distances {
  double median_gsd = 0;        // of a point in its nearest photo
  double observed_gsd = 0;      // of an observation
  double working_distance = 0;  // of an observation
};

Distances MeasureDistances(const GuidedMap& map) {
  std::vector<Eigen::Vector3d> centres;
  for (const GuidedPhoto& photo : map.photos) centres.push_back(photo.cam_from_world.Centre());
  std::vector<double> nearest, observed, distances;
  const size_t stride = 1 + map.points.size() / kMaxSamples;
  for (size_t i = 0; i < map.points.size(); i += stride) {
    const GuidedPoint& point = map.points[i];
    double best = std::numeric_limits<double>::infinity();
    for (const uint32_t photo : point.photos) {
      const double distance = (point.xyz - centres[photo]).norm();
      const double gsd = distance / map.cameras[map.photos[photo].camera].FocalPx();
      best = std::min(best, gsd);
      observed.push_back(gsd);
      distances.push_back(distance);
    }
    if (!point.photos.empty()) nearest.push_back(best);
  }
  return {UpperMedian(std::move(nearest)), UpperMedian(std::move(observed)),
          UpperMedian(std::move(distances))};
}

double CellWidth(const GuidedMap& map, double points_per_photo, double observed_gsd,
                 double points_per_cell, double min_px) {
  std::vector<double> widths, areas;
  for (const GuidedPhoto& photo : map.photos) {
    const GuidedCamera& camera = map.cameras[photo.camera];
    widths.push_back(camera.width_px);
    areas.push_back(static_cast<double>(camera.width_px) * camera.height_px);
  }
  const double wanted_px =
      std::sqrt(UpperMedian(std::move(areas)) * points_per_cell / std::max(1.0, points_per_photo));
  const double max_px = std::max(min_px, kMaxCellShare * UpperMedian(std::move(widths)));
  return std::clamp(wanted_px, min_px, max_px) * observed_gsd;
}

}  // namespace

std::vector<uint32_t> CountObservations(const GuidedMap& map) {
  std::vector<uint32_t> counts(map.photos.size(), 0);
  for (const GuidedPoint& point : map.points) {
    for (const uint32_t photo : point.photos) ++counts[photo];
  }
  return counts;
}

PlaceScale MeasureScale(const GuidedMap& map, const std::vector<uint32_t>& num_observations) {
  const Distances distances = MeasureDistances(map);
  if (distances.median_gsd <= 0) return {};
  const double points_per_photo =
      UpperMedian(std::vector<double>(num_observations.begin(), num_observations.end()));
  return {distances.median_gsd, distances.working_distance,
          CellWidth(map, points_per_photo, distances.observed_gsd, kPointsPerCell, kMinCellPx),
          CellWidth(map, points_per_photo, distances.observed_gsd, kPointsPerPart, kMinPartPx)};
}

bool IsWithin(double tolerance, const PlaceScale& a, const PlaceScale& b) {
  const auto is_within = [&](double x, double y) {
    return std::abs(x - y) <= tolerance * std::max(x, y);
  };
  return is_within(a.median_gsd, b.median_gsd) &&
         is_within(a.working_distance, b.working_distance) && is_within(a.cell, b.cell) &&
         is_within(a.part_cell, b.part_cell);
}

}  // namespace skein
