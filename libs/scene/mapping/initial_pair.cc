#include "mapping/initial_pair.h"

#include <algorithm>
#include <vector>

#include "core/angles.h"
#include "core/option_check.h"
#include "mapping/registration.h"
#include "sfm/ids.h"
#include "sfm/random.h"
#include "sfm/reprojection.h"
#include "sfm/triangulation.h"
#include "sfm/two_view_geometry.h"

namespace skein {
namespace {

constexpr double kFocalFactors[] = {1.0, 0.8, 0.65, 0.5, 1.25, 1.55, 1.9};
// The points of a pair are at first those seen under half its median angle, at most this.
constexpr double kMaxPointAngleDeg = 16.0;
// Another focal length than the prior must win by this.
constexpr double kMinGain = 1.03;

std::vector<Eigen::Vector2d> Points(const Image& image) {
  std::vector<Eigen::Vector2d> points;
  for (const Point2D& point : image.Points2D()) points.push_back(point.XY());
  return points;
}

void ScaleFocal(double factor, Camera* camera) {
  for (const size_t i : camera->FocalLengthIdxs()) camera->Params(i) *= factor;
}

struct Pair {
  Camera camera1, camera2;
  std::vector<Eigen::Vector2d> points1, points2;
  FeatureMatches matches;
};

TwoViewGeometry Estimate(const Pair& pair) {
  RansacLimits limits;
  limits.min_num_trials = 30;
  limits.max_num_trials = 2000;
  limits.max_error = limits::kMaxErrorPx;
  return EstimateCalibrated({pair.camera1, pair.points1, pair.camera2, pair.points2}, pair.matches,
                            limits);
}

// Tries focal lengths for cameras that have none from EXIF; leaves the best in `pair`.
TwoViewGeometry EstimateWithFocal(bool free1, bool free2, Pair* pair) {
  const Pair prior = *pair;
  TwoViewGeometry best;
  double best_score = -1;
  for (const double factor : kFocalFactors) {
    if (factor != 1.0 && !free1 && !free2) break;
    Pair scaled = prior;
    if (free1) ScaleFocal(factor, &scaled.camera1);
    if (free2) ScaleFocal(factor, &scaled.camera2);
    const TwoViewGeometry geometry = Estimate(scaled);
    const double score =
        static_cast<double>(geometry.inlier_matches.size()) * (factor == 1.0 ? kMinGain : 1.0);
    if (score <= best_score) continue;
    best_score = score;
    best = geometry;
    *pair = scaled;
  }
  return best;
}

// Whether the camera's focal length is open.
bool IsFree(const SceneMap& map, const Camera& camera) {
  const CameraState& state = map.camera_state(camera.CameraId());
  return !state.focal_from_exif && !state.refined && state.num_registered == 0;
}

// Adds the points that both images see under at least `min_angle`.
int TriangulatePair(const FeatureMatches& matches, double min_angle, ImageId image_id1,
                    ImageId image_id2, SceneMap* map) {
  const Image& image1 = map->reconstruction().Image(image_id1);
  const Image& image2 = map->reconstruction().Image(image_id2);
  const Camera& camera1 = map->reconstruction().Camera(image1.CameraId());
  const Camera& camera2 = map->reconstruction().Camera(image2.CameraId());
  const Matrix3x4d P1 = image1.ProjectionMatrix();
  const Matrix3x4d P2 = image2.ProjectionMatrix();
  int num_points = 0;
  for (const FeatureMatch& match : matches) {
    const Eigen::Vector3d xyz =
        TriangulatePoint(P1, P2, camera1.ImageToWorld(image1.Point2D(match.point2D_idx1).XY()),
                         camera2.ImageToWorld(image2.Point2D(match.point2D_idx2).XY()));
    const double angle =
        CalculateTriangulationAngle(image1.ProjectionCenter(), image2.ProjectionCenter(), xyz);
    if (!(angle >= min_angle) || !HasPointPositiveDepth(P1, xyz) ||
        !HasPointPositiveDepth(P2, xyz)) {
      continue;
    }
    Track track;
    track.AddElement(image_id1, match.point2D_idx1);
    track.AddElement(image_id2, match.point2D_idx2);
    map->AddPoint(xyz, track);
    ++num_points;
  }
  return num_points;
}

Status CheckGeometry(const InitialPairOptions& options, const InitialPairResult& result) {
  if (result.num_inliers < options.min_num_inliers) return FailedPrecondition("too few inliers");
  if (result.triangulation_angle_deg < options.min_triangulation_angle_deg) {
    return FailedPrecondition("too small a triangulation angle");
  }
  return Status::Ok();
}

void Accept(const Pair& pair, const TwoViewGeometry& geometry, ImageId image_id1, ImageId image_id2,
            SceneMap* map, InitialPairResult* result) {
  map->SetPose(image_id1, Eigen::Vector4d(1, 0, 0, 0), Eigen::Vector3d::Zero());
  map->SetPose(image_id2, geometry.qvec, geometry.tvec);
  map->SetCamera(pair.camera1.CameraId(), pair.camera1.Params());
  map->SetCamera(pair.camera2.CameraId(), pair.camera2.Params());
  map->Register(image_id1);
  map->Register(image_id2);
  const double min_angle = std::min(DegToRad(kMaxPointAngleDeg), 0.5 * geometry.tri_angle);
  result->num_points =
      TriangulatePair(geometry.inlier_matches, min_angle, image_id1, image_id2, map);
}

}  // namespace

Status InitialPairOptions::Check() const {
  return FirstError(
      {InRange("min_num_inliers", min_num_inliers, 5, 1'000'000),
       InRange("min_triangulation_angle_deg", min_triangulation_angle_deg, 0.0, 180.0)});
}

InitialPairOptions OptionsOfSeed(int num_inliers, double triangulation_angle_rad) {
  InitialPairOptions options;
  options.min_num_inliers = std::clamp(num_inliers / 2, 30, options.min_num_inliers);
  options.min_triangulation_angle_deg =
      std::min(options.min_triangulation_angle_deg, RadToDeg(0.5 * triangulation_angle_rad));
  return options;
}

InitialPairResult RegisterInitialPair(const InitialPairOptions& options, ImageId image_id1,
                                      ImageId image_id2, SceneMap* map) {
  InitialPairResult result;
  result.status = options.Check();  // a seed's, which came over the bus
  if (!result.status.ok()) return result;
  const Reconstruction& reconstruction = map->reconstruction();
  const Image& image1 = reconstruction.Image(image_id1);
  const Image& image2 = reconstruction.Image(image_id2);
  Pair pair{reconstruction.Camera(image1.CameraId()), reconstruction.Camera(image2.CameraId()),
            Points(image1), Points(image2), map->MatchesOfPair(image_id1, image_id2)};
  SetRandomSeed(SeedFromIds(image_id1, image_id2));
  TwoViewGeometry geometry =
      EstimateWithFocal(IsFree(*map, pair.camera1), IsFree(*map, pair.camera2), &pair);
  result.num_inliers = static_cast<int>(geometry.inlier_matches.size());
  if (result.num_inliers < options.min_num_inliers ||
      !EstimateRelativePose({pair.camera1, pair.points1, pair.camera2, pair.points2}, &geometry)) {
    result.status = FailedPrecondition("no relative pose");
    return result;
  }
  result.triangulation_angle_deg = RadToDeg(geometry.tri_angle);
  result.status = CheckGeometry(options, result);
  if (!result.status.ok()) return result;
  Accept(pair, geometry, image_id1, image_id2, map, &result);
  if (result.num_points >= options.min_num_inliers / 2) return result;
  result.status = FailedPrecondition("too few points");
  map->Deregister(image_id1);
  map->Deregister(image_id2);
  return result;
}

}  // namespace skein
