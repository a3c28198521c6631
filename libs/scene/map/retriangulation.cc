#include "map/retriangulation.h"

#include "core/angles.h"
#include "core/limits.h"
#include "map/map_access.h"
#include "sfm/ids.h"
#include "sfm/reprojection.h"
#include "sfm/triangulation.h"

namespace skein {
namespace {

// COLMAP's re_min_ratio and re_max_angle_error: pairs with a smaller part of triangulated matches
// are tried; to continue a track.
constexpr double kMinTriangulatedShare = 0.2;
constexpr double kMaxRetriangulationErrorDeg = 5.0;

bool IsUnderReconstructed(const FeatureMatches& matches, const Image& image1, const Image& image2) {
  size_t num_common = 0;
  for (const FeatureMatch& match : matches) {
    const Point2D& point1 = image1.Point2D(match.point2D_idx1);
    const Point2D& point2 = image2.Point2D(match.point2D_idx2);
    num_common += point1.HasPoint3D() && point1.Point3DId() == point2.Point3DId();
  }
  return static_cast<double>(num_common) <
         kMinTriangulatedShare * static_cast<double>(matches.size());
}

// A registered photo of a pair.
class View {
 public:
  View(const Reconstruction& reconstruction, const Image& image)
      : image_(image),
        camera_(reconstruction.Camera(image.CameraId())),
        cam_from_world_(image.ProjectionMatrix()),
        center_(image.ProjectionCenter()) {}

  const Point2D& At(Point2DIdx index) const { return image_.Point2D(index); }
  TrackElement Element(Point2DIdx index) const { return {image_.ImageId(), index}; }
  const Matrix3x4d& cam_from_world() const { return cam_from_world_; }
  const Eigen::Vector3d& center() const { return center_; }
  Eigen::Vector2d Normalized(Point2DIdx index) const {
    return camera_.ImageToWorld(At(index).XY());
  }
  double AngularError(Point2DIdx index, const Eigen::Vector3d& xyz) const {
    return CalculateAngularError(At(index).XY(), xyz, cam_from_world_, camera_);
  }

 private:
  const Image& image_;
  const Camera& camera_;
  const Matrix3x4d cam_from_world_;
  const Eigen::Vector3d center_;
};

// Adds the free keypoint of `to` to the track of the other if the point is seen there.
bool Continue(Point3DId point3D_id, const View& to, Point2DIdx index,
              Reconstruction* reconstruction) {
  const double error = to.AngularError(index, reconstruction->Point3D(point3D_id).XYZ());
  if (!(error <= DegToRad(kMaxRetriangulationErrorDeg))) return false;
  reconstruction->AddObservation(point3D_id, to.Element(index));
  return true;
}

bool Create(const View& view1, Point2DIdx index1, const View& view2, Point2DIdx index2,
            Reconstruction* reconstruction) {
  const Eigen::Vector3d xyz = TriangulatePoint(view1.cam_from_world(), view2.cam_from_world(),
                                               view1.Normalized(index1), view2.Normalized(index2));
  const double max_error = DegToRad(Triangulator::kMaxCreateErrorDeg);
  if (!HasPointPositiveDepth(view1.cam_from_world(), xyz) ||
      !HasPointPositiveDepth(view2.cam_from_world(), xyz) ||
      CalculateTriangulationAngle(view1.center(), view2.center(), xyz) <
          DegToRad(limits::kMinTriangulationAngleDeg) ||
      view1.AngularError(index1, xyz) > max_error || view2.AngularError(index2, xyz) > max_error) {
    return false;
  }
  Track track;
  track.AddElement(view1.Element(index1));
  track.AddElement(view2.Element(index2));
  reconstruction->AddPoint3D(xyz, track);
  return true;
}

}  // namespace

int Retriangulate(const ImagePairs& pairs, SceneMap* map) {
  Reconstruction& reconstruction = MapAccess::Model(map);
  int num_added = 0;
  for (const auto& [id1, id2] : pairs) {
    const Image& image1 = reconstruction.Image(id1);
    const Image& image2 = reconstruction.Image(id2);
    if (!image1.IsRegistered() || !image2.IsRegistered()) continue;
    const FeatureMatches matches = map->MatchesOfPair(id1, id2);
    if (!IsUnderReconstructed(matches, image1, image2)) continue;
    const View view1(reconstruction, image1), view2(reconstruction, image2);
    for (const FeatureMatch& match : matches) {
      const Point2DIdx i1 = match.point2D_idx1, i2 = match.point2D_idx2;
      const Point2D &point1 = view1.At(i1), &point2 = view2.At(i2);
      const bool has1 = point1.HasPoint3D(), has2 = point2.HasPoint3D();
      if (has1 && !has2) {
        num_added += Continue(point1.Point3DId(), view2, i2, &reconstruction);
      } else if (has2 && !has1) {
        num_added += Continue(point2.Point3DId(), view1, i1, &reconstruction);
      } else if (!has1 && !map->graph().IsTwoViewObservation(id1, i1)) {
        num_added += 2 * Create(view1, i1, view2, i2, &reconstruction);
      }
    }
  }
  return num_added;
}

}  // namespace skein
