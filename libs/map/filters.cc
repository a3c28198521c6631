#include "map/filters.h"

#include <algorithm>
#include <cmath>

#include "base/projection.h"
#include "base/triangulation.h"
#include "core/option_check.h"
#include "map/map_access.h"
#include "util/math.h"

namespace skein {
namespace {

// Deletes the observations of a point that are in `bad`; true if the point is left.
bool DeleteObservations(const std::vector<colmap::TrackElement>& bad, Point3DId id,
                        colmap::Reconstruction* reconstruction) {
  const size_t length = reconstruction->Point3D(id).Track().Length();
  if (length - bad.size() < 2) {
    reconstruction->DeletePoint3D(id);
    return false;
  }
  for (const colmap::TrackElement& element : bad) {
    reconstruction->DeleteObservation(element.image_id, element.point2D_idx);
  }
  return true;
}

// One point: `elements` with their errors. Returns the observations taken out.
int FilterPoint(const FilterOptions& options, Point3DId id,
                const std::vector<std::pair<colmap::TrackElement, double>>& errors,
                colmap::Reconstruction* reconstruction) {
  const int length = static_cast<int>(reconstruction->Point3D(id).Track().Length());
  std::vector<colmap::TrackElement> bad;
  double sum = 0;
  for (const auto& [element, error] : errors) {
    if (error <= options.max_reprojection_error_px) {
      sum += error;
    } else {
      bad.push_back(element);
    }
  }
  if (!DeleteObservations(bad, id, reconstruction)) return length;
  colmap::Point3D& point = reconstruction->Point3D(id);
  if (!HasTriangulationAngle(*reconstruction, point,
                             colmap::DegToRad(options.min_triangulation_angle_deg))) {
    reconstruction->DeletePoint3D(id);
    return length;
  }
  if (static_cast<int>(errors.size()) == length) {
    point.SetError(sum / static_cast<double>(errors.size() - bad.size()));
  }
  return static_cast<int>(bad.size());
}

double SquaredError(const colmap::Reconstruction& reconstruction, const colmap::Point3D& point,
                    const colmap::TrackElement& element) {
  const colmap::Image& image = reconstruction.Image(element.image_id);
  return colmap::CalculateSquaredReprojectionError(image.Point2D(element.point2D_idx).XY(),
                                                   point.XYZ(), image.Qvec(), image.Tvec(),
                                                   reconstruction.Camera(image.CameraId()));
}

double SumOfSquaredErrors(const colmap::Reconstruction& reconstruction,
                          const colmap::Point3D& point) {
  double sum = 0;
  for (const colmap::TrackElement& element : point.Track().Elements()) {
    sum += SquaredError(reconstruction, point, element);
  }
  return sum;
}

}  // namespace

std::vector<Point3DId> AllPoints(const SceneMap& map) {
  std::vector<Point3DId> ids;
  for (const auto& [id, point] : map.reconstruction().Points3D()) ids.push_back(id);
  std::sort(ids.begin(), ids.end());
  return ids;
}

bool HasTriangulationAngle(const colmap::Reconstruction& reconstruction,
                           const colmap::Point3D& point, double min_angle_rad) {
  const double max_cosine = std::cos(min_angle_rad);
  std::vector<Eigen::Vector3d> rays;
  for (const colmap::TrackElement& element : point.Track().Elements()) {
    const Eigen::Vector3d center = reconstruction.Image(element.image_id).ProjectionCenter();
    rays.push_back((point.XYZ() - center).normalized());
    for (size_t i = 0; i + 1 < rays.size(); ++i) {
      if (rays[i].dot(rays.back()) <= max_cosine) return true;
    }
  }
  return false;
}

Status FilterOptions::Check() const {
  return FirstError(
      {InRange("max_reprojection_error_px", max_reprojection_error_px, 0.01, 1000.0),
       InRange("min_triangulation_angle_deg", min_triangulation_angle_deg, 0.0, 180.0)});
}

int FilterBundle(const FilterOptions& options, const Bundle& bundle, SceneMap* map) {
  colmap::Reconstruction& reconstruction = MapAccess::Model(map);
  const std::vector<double> errors = ReprojectionErrors(bundle);
  int num_filtered = 0;
  std::vector<std::pair<colmap::TrackElement, double>> of_point;
  for (const BundlePoint& point : bundle.points) {
    if (!reconstruction.ExistsPoint3D(point.point3D_id)) continue;
    of_point.clear();
    for (int i = point.first; i < point.first + point.count; ++i) {
      const BundleObservation& observation = bundle.observations[i];
      of_point.emplace_back(
          colmap::TrackElement(bundle.poses[observation.pose].image_id, observation.point2D_idx),
          errors[i]);
    }
    num_filtered += FilterPoint(options, point.point3D_id, of_point, &reconstruction);
  }
  return num_filtered;
}

int FilterPoints(const FilterOptions& options, const std::vector<Point3DId>& points,
                 SceneMap* map) {
  colmap::Reconstruction& reconstruction = MapAccess::Model(map);
  int num_filtered = 0;
  std::vector<std::pair<colmap::TrackElement, double>> errors;
  for (const Point3DId id : points) {
    if (!reconstruction.ExistsPoint3D(id)) continue;
    const colmap::Point3D& point = reconstruction.Point3D(id);
    errors.clear();
    for (const colmap::TrackElement& element : point.Track().Elements()) {
      errors.emplace_back(element, std::sqrt(SquaredError(reconstruction, point, element)));
    }
    num_filtered += FilterPoint(options, id, errors, &reconstruction);
  }
  return num_filtered;
}

int FilterPointsOfTwoPhotos(SceneMap* map) {
  constexpr double kChiSquared99 = 6.635;  // 1 degree of freedom
  colmap::Reconstruction& reconstruction = MapAccess::Model(map);
  double sum = 0, freedom = 0;
  std::vector<std::pair<Point3DId, double>> of_two;  // with the sum of squared errors
  for (const Point3DId id : AllPoints(*map)) {
    const colmap::Point3D& point = reconstruction.Point3D(id);
    const double squared = SumOfSquaredErrors(reconstruction, point);
    const double length = static_cast<double>(point.Track().Length());
    if (length <= 2) {
      of_two.emplace_back(id, squared);
    } else {
      sum += squared;
      freedom += 2 * length - 3;
    }
  }
  if (freedom == 0) return 0;
  int num_removed = 0;
  for (const auto& [id, squared] : of_two) {
    if (squared <= kChiSquared99 * sum / freedom) continue;
    reconstruction.DeletePoint3D(id);
    ++num_removed;
  }
  return num_removed;
}

}  // namespace skein
