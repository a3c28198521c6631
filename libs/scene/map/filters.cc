#include "map/filters.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/angles.h"
#include "core/statistics.h"
#include "map/map_access.h"
#include "sfm/model_io.h"
#include "sfm/reprojection.h"
#include "sfm/triangulation.h"

namespace skein {
namespace {

// Deletes the observations of a point that are in `bad`; true if the point is left.
bool DeleteObservations(const std::vector<TrackElement>& bad, Point3DId id,
                        Reconstruction* reconstruction) {
  const size_t length = reconstruction->Point3D(id).Track().Length();
  if (length - bad.size() < 2) {
    reconstruction->DeletePoint3D(id);
    return false;
  }
  for (const TrackElement& element : bad) {
    reconstruction->DeleteObservation(element.image_id, element.point2D_idx);
  }
  return true;
}

// One point: `elements` with their errors. Returns the observations taken out.
int FilterPoint(double max_error_px, Point3DId id,
                const std::vector<std::pair<TrackElement, double>>& errors,
                Reconstruction* reconstruction) {
  const int length = static_cast<int>(reconstruction->Point3D(id).Track().Length());
  std::vector<TrackElement> bad;
  double sum = 0;
  for (const auto& [element, error] : errors) {
    if (error <= max_error_px) {
      sum += error;
    } else {
      bad.push_back(element);
    }
  }
  if (!DeleteObservations(bad, id, reconstruction)) return length;
  if (static_cast<int>(errors.size()) == length) {
    reconstruction->Point3D(id).SetError(sum / static_cast<double>(errors.size() - bad.size()));
  }
  return static_cast<int>(bad.size());
}

struct Depth {
  Point2DIdx index;
  double depth;
};

// The depths of the observed points, in units of the world.
std::vector<Depth> DepthsOf(const Reconstruction& reconstruction, const Image& image) {
  const Eigen::Vector3d forward = image.RotationMatrix().row(2);
  std::vector<Depth> depths;
  for (Point2DIdx i = 0; i < image.NumPoints2D(); ++i) {
    if (!image.Point2D(i).HasPoint3D()) continue;
    const Eigen::Vector3d& xyz = reconstruction.Point3D(image.Point2D(i).Point3DId()).XYZ();
    depths.push_back({i, forward.dot(xyz) + image.Tvec().z()});
  }
  return depths;
}

double MedianOf(const std::vector<Depth>& depths) {
  std::vector<double> values;
  for (const Depth& depth : depths) values.push_back(depth.depth);
  return UpperMedian(std::move(values));
}

double SquaredError(const Reconstruction& reconstruction, const Point3D& point,
                    const TrackElement& element) {
  const Image& image = reconstruction.Image(element.image_id);
  return CalculateSquaredReprojectionError(image.Point2D(element.point2D_idx).XY(), point.XYZ(),
                                           image.Qvec(), image.Tvec(),
                                           reconstruction.Camera(image.CameraId()));
}

double SumOfSquaredErrors(const Reconstruction& reconstruction, const Point3D& point) {
  double sum = 0;
  for (const TrackElement& element : point.Track().Elements()) {
    sum += SquaredError(reconstruction, point, element);
  }
  return sum;
}

// The observations of a point that goes as its angle is too small.
int FilterByAngle(Point3DId id, Reconstruction* model) {
  constexpr double kMinAngleRad = DegToRad(limits::kMinTriangulationAngleDeg);
  if (!model->ExistsPoint3D(id)) return 0;
  const Point3D& point = model->Point3D(id);
  if (HasTriangulationAngle(*model, point, kMinAngleRad)) return 0;
  const int length = static_cast<int>(point.Track().Length());
  model->DeletePoint3D(id);
  return length;
}

int FilterObservations(const std::vector<Point3DId>& points, double max_error_px,
                       Reconstruction* model) {
  int num_filtered = 0;
  std::vector<std::pair<TrackElement, double>> errors;
  for (const Point3DId id : points) {
    if (!model->ExistsPoint3D(id)) continue;
    const Point3D& point = model->Point3D(id);
    errors.clear();
    for (const TrackElement& element : point.Track().Elements()) {
      errors.emplace_back(element, std::sqrt(SquaredError(*model, point, element)));
    }
    num_filtered += FilterPoint(max_error_px, id, errors, model);
  }
  return num_filtered;
}

}  // namespace

std::vector<Point3DId> AllPoints(const SceneMap& map) {
  return AscendingPoints(map.reconstruction());
}

bool HasTriangulationAngle(const Reconstruction& reconstruction, const Point3D& point,
                           double min_angle_rad) {
  const double max_cosine = std::cos(min_angle_rad);
  std::vector<Eigen::Vector3d> rays;
  for (const TrackElement& element : point.Track().Elements()) {
    const Eigen::Vector3d center = reconstruction.Image(element.image_id).ProjectionCenter();
    rays.push_back((point.XYZ() - center).normalized());
    for (size_t i = 0; i + 1 < rays.size(); ++i) {
      if (rays[i].dot(rays.back()) <= max_cosine) return true;
    }
  }
  return false;
}

int FilterBundle(const Bundle& bundle, SceneMap* map) {
  Reconstruction& reconstruction = MapAccess::Model(map);
  const std::vector<double> errors = ReprojectionErrors(bundle);
  int num_filtered = 0;
  std::vector<std::pair<TrackElement, double>> of_point;
  for (const BundlePoint& point : bundle.points) {
    if (!reconstruction.ExistsPoint3D(point.point3D_id)) continue;
    of_point.clear();
    for (int i = point.first; i < point.first + point.count; ++i) {
      const BundleObservation& observation = bundle.observations[i];
      of_point.emplace_back(
          TrackElement(bundle.poses[observation.pose].image_id, observation.point2D_idx),
          errors[i]);
    }
    num_filtered += FilterPoint(limits::kMaxErrorPx, point.point3D_id, of_point, &reconstruction);
    num_filtered += FilterByAngle(point.point3D_id, &reconstruction);
  }
  return num_filtered;
}

int FilterObservations(const std::vector<Point3DId>& points, SceneMap* map) {
  return FilterObservations(points, limits::kMaxErrorPx, &MapAccess::Model(map));
}

int FilterPoints(const std::vector<Point3DId>& points, SceneMap* map, double max_error_px) {
  return FilterPoints(points, &MapAccess::Model(map), max_error_px);
}

int FilterPoints(const std::vector<Point3DId>& points, Reconstruction* model, double max_error_px) {
  int num_filtered = FilterObservations(points, max_error_px, model);
  for (const Point3DId id : points) num_filtered += FilterByAngle(id, model);
  return num_filtered;
}

int FilterNearPoints(const std::vector<ImageId>& photos, SceneMap* map) {
  constexpr double kMinDepthRatio = 0.01;
  Reconstruction& reconstruction = MapAccess::Model(map);
  std::vector<TrackElement> near;
  for (const ImageId id : photos) {
    const std::vector<Depth> depths = DepthsOf(reconstruction, reconstruction.Image(id));
    if (depths.empty()) continue;
    const double least = kMinDepthRatio * MedianOf(depths);
    for (const Depth& depth : depths) {
      if (depth.depth < least) near.emplace_back(id, depth.index);
    }
  }
  for (const TrackElement& element : near) {  // a point may be gone with another observation
    const Point2D& keypoint = reconstruction.Image(element.image_id).Point2D(element.point2D_idx);
    if (keypoint.HasPoint3D()) DeleteObservations({element}, keypoint.Point3DId(), &reconstruction);
  }
  return static_cast<int>(near.size());
}

int FilterPointsOfTwoPhotos(SceneMap* map) {
  constexpr double kChiSquared99 = 6.635;  // 1 degree of freedom
  Reconstruction& reconstruction = MapAccess::Model(map);
  double sum = 0, freedom = 0;
  std::vector<std::pair<Point3DId, double>> of_two;  // with the sum of squared errors
  for (const Point3DId id : AllPoints(*map)) {
    const Point3D& point = reconstruction.Point3D(id);
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
