#include "map/retriangulation.h"

#include <algorithm>

#include "base/projection.h"
#include "base/triangulation.h"
#include "core/option_check.h"
#include "map/map_access.h"
#include "util/math.h"
#include "util/random.h"

namespace skein {
namespace {

bool IsUnderReconstructed(const colmap::FeatureMatches& matches, const colmap::Image& image1,
                          const colmap::Image& image2, double min_ratio) {
  size_t num_common = 0;
  for (const colmap::FeatureMatch& match : matches) {
    const colmap::Point2D& point1 = image1.Point2D(match.point2D_idx1);
    const colmap::Point2D& point2 = image2.Point2D(match.point2D_idx2);
    num_common += point1.HasPoint3D() && point1.Point3DId() == point2.Point3DId();
  }
  return static_cast<double>(num_common) < min_ratio * static_cast<double>(matches.size());
}

// Adds the free keypoint of `to` to the track of the other if the point is seen there.
bool Continue(double max_angle_error_rad, Point3DId point3D_id, ImageId to, Point2DIdx index,
              colmap::Reconstruction* reconstruction) {
  const colmap::Image& image = reconstruction->Image(to);
  const double error = colmap::CalculateAngularError(
      image.Point2D(index).XY(), reconstruction->Point3D(point3D_id).XYZ(), image.Qvec(),
      image.Tvec(), reconstruction->Camera(image.CameraId()));
  if (!(error <= max_angle_error_rad)) return false;
  reconstruction->AddObservation(point3D_id, {to, index});
  return true;
}

bool Create(const colmap::IncrementalTriangulator::Options& options, ImageId id1, Point2DIdx index1,
            ImageId id2, Point2DIdx index2, colmap::Reconstruction* reconstruction) {
  const colmap::Image& image1 = reconstruction->Image(id1);
  const colmap::Image& image2 = reconstruction->Image(id2);
  const colmap::Camera& camera1 = reconstruction->Camera(image1.CameraId());
  const colmap::Camera& camera2 = reconstruction->Camera(image2.CameraId());
  const Eigen::Vector2d xy1 = image1.Point2D(index1).XY();
  const Eigen::Vector2d xy2 = image2.Point2D(index2).XY();
  const Eigen::Matrix3x4d P1 = image1.ProjectionMatrix();
  const Eigen::Matrix3x4d P2 = image2.ProjectionMatrix();
  const Eigen::Vector3d xyz =
      colmap::TriangulatePoint(P1, P2, camera1.ImageToWorld(xy1), camera2.ImageToWorld(xy2));
  const double max_error = colmap::DegToRad(options.create_max_angle_error);
  if (!colmap::HasPointPositiveDepth(P1, xyz) || !colmap::HasPointPositiveDepth(P2, xyz) ||
      colmap::CalculateTriangulationAngle(image1.ProjectionCenter(), image2.ProjectionCenter(),
                                          xyz) < colmap::DegToRad(options.min_angle) ||
      colmap::CalculateAngularError(xy1, xyz, P1, camera1) > max_error ||
      colmap::CalculateAngularError(xy2, xyz, P2, camera2) > max_error) {
    return false;
  }
  colmap::Track track;
  track.AddElement(id1, index1);
  track.AddElement(id2, index2);
  reconstruction->AddPoint3D(xyz, track);
  return true;
}

}  // namespace

Status CheckTriangulation(const colmap::IncrementalTriangulator::Options& options) {
  if (options.Check()) return Status::Ok();
  return InvalidArgument("triangulation: COLMAP's log says which option to change");
}

Status RetriangulationOptions::Check() const {
  return FirstError({InRange("min_ratio", min_ratio, 0.0, 1.0),
                     InRange("max_angle_error_deg", max_angle_error_deg, 0.0, 180.0),
                     CheckTriangulation(triangulation)});
}

int Retriangulate(const RetriangulationOptions& options,
                  const std::vector<std::pair<ImageId, ImageId>>& pairs, SceneMap* map) {
  ThrowUnlessSound(options.Check());
  colmap::Reconstruction& reconstruction = MapAccess::Model(map);
  const double max_angle = colmap::DegToRad(options.max_angle_error_deg);
  int num_added = 0;
  for (const auto& [id1, id2] : pairs) {
    const colmap::Image& image1 = reconstruction.Image(id1);
    const colmap::Image& image2 = reconstruction.Image(id2);
    if (!image1.IsRegistered() || !image2.IsRegistered()) continue;
    const colmap::FeatureMatches matches = map->MatchesOfPair(id1, id2);
    if (!IsUnderReconstructed(matches, image1, image2, options.min_ratio)) continue;
    for (const colmap::FeatureMatch& match : matches) {
      const Point2DIdx i1 = match.point2D_idx1, i2 = match.point2D_idx2;
      const bool has1 = image1.Point2D(i1).HasPoint3D();
      const bool has2 = image2.Point2D(i2).HasPoint3D();
      if (has1 && !has2) {
        num_added += Continue(max_angle, image1.Point2D(i1).Point3DId(), id2, i2, &reconstruction);
      } else if (has2 && !has1) {
        num_added += Continue(max_angle, image2.Point2D(i2).Point3DId(), id1, i1, &reconstruction);
      } else if (!has1 && !(options.triangulation.ignore_two_view_tracks &&
                            map->graph().IsTwoViewObservation(id1, i1))) {
        num_added += 2 * Create(options.triangulation, id1, i1, id2, i2, &reconstruction);
      }
    }
  }
  return num_added;
}

}  // namespace skein
