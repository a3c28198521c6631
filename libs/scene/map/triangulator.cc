#include "map/triangulator.h"

#include <algorithm>
#include <iterator>
#include <limits>
#include <utility>

#include "core/angles.h"
#include "core/limits.h"
#include "map/image_pose.h"
#include "sfm/reprojection.h"

namespace skein {
namespace {

constexpr double kMaxContinueErrorDeg = 2.0;  // to continue a track: COLMAP's default
// As many observations that a new point does not fit are tried for another one.
constexpr size_t kMinRest = 3;

}  // namespace

void Triangulator::Begin() {
  is_bogus_.clear();
  tried_.clear();
}

bool Triangulator::HasBogusParams(const Camera& camera) {
  const auto [entry, is_new] = is_bogus_.try_emplace(camera.CameraId());
  if (is_new) entry->second = !HasPossibleIntrinsics(camera);
  return entry->second;
}

bool Triangulator::IsUsable(const Image& image) {
  return image.IsRegistered() && !HasBogusParams(model_.Camera(image.CameraId()));
}

void Triangulator::FindMatches(ImageId id, Point2DIdx index) {
  matches_.clear();
  for (const auto& match : graph_.FindCorrespondences(id, index)) {
    const Image& image = model_.Image(match.image_id);
    if (!image.IsRegistered()) continue;
    const Camera& camera = model_.Camera(image.CameraId());
    if (!HasBogusParams(camera)) matches_.push_back({&image, &camera, match.point2D_idx});
  }
}

size_t Triangulator::TriangulateImage(ImageId id) {
  Begin();
  const Image& image = model_.Image(id);
  if (!IsUsable(image)) return 0;
  const Camera& camera = model_.Camera(image.CameraId());
  size_t num_added = 0;
  for (Point2DIdx i = 0; i < image.NumPoints2D(); ++i) {
    FindMatches(id, i);
    if (matches_.empty()) continue;
    const Sight sight{&image, &camera, i};
    num_added += Continue(sight);
    matches_.push_back(sight);
    num_added += Create(matches_);
  }
  return num_added;
}

size_t Triangulator::StartPoints(ImageId id) {
  Begin();
  const Image& image = model_.Image(id);
  if (!IsUsable(image)) return 0;
  const Camera& camera = model_.Camera(image.CameraId());
  TriangulationLimits limits;
  limits.error = TriangulationLimits::Error::kReprojection;
  limits.max_error = limits::kMaxErrorPx;
  size_t num_added = 0;
  for (Point2DIdx i = 0; i < image.NumPoints2D(); ++i) {
    const Sight sight{&image, &camera, i};
    if (sight.Keypoint().HasPoint3D() || IsOfTwoViews(sight)) continue;
    FindMatches(id, i);
    const bool is_seen = std::any_of(matches_.begin(), matches_.end(), [](const Sight& match) {
      return match.Keypoint().HasPoint3D();
    });
    if (is_seen || matches_.empty()) continue;
    matches_.push_back(sight);
    num_added += StartPoint(limits, matches_);
  }
  return num_added;
}

bool Triangulator::IsOfTwoViews(const Sight& sight) const {
  return graph_.IsTwoViewObservation(sight.image->ImageId(), sight.index);
}

// Adds points of those that observe none, until too few are left.
size_t Triangulator::Create(const std::vector<Sight>& sights) {
  std::vector<Sight> free;
  free.reserve(sights.size());
  for (const Sight& sight : sights) {
    if (!sight.Keypoint().HasPoint3D()) free.push_back(sight);
  }
  if (free.size() < 2 || (free.size() == 2 && IsOfTwoViews(free[0]))) return 0;
  TriangulationLimits limits;
  limits.max_error = DegToRad(kMaxCreateErrorDeg);
  const size_t length = StartPoint(limits, free);
  if (length == 0 || free.size() - length < kMinRest) return length;
  return length + Create(free);
}

// Returns the length of the new point's track, 0 if there is none.
size_t Triangulator::StartPoint(const TriangulationLimits& limits,
                                const std::vector<Sight>& sights) {
  std::vector<TriangulationView> views;
  views.reserve(sights.size());
  for (const Sight& sight : sights) {
    const Eigen::Vector2d& pixel = sight.Keypoint().XY();
    views.push_back({pixel, sight.camera->ImageToWorld(pixel), sight.image->ProjectionMatrix(),
                     sight.image->ProjectionCenter(), sight.camera});
  }
  Eigen::Vector3d xyz;
  std::vector<char> inlier_mask;
  if (!EstimateTriangulation(limits, views, &inlier_mask, &xyz)) return 0;
  Track track;
  track.Reserve(sights.size());
  for (size_t i = 0; i < sights.size(); ++i) {
    if (inlier_mask[i]) track.AddElement(sights[i].Element());
  }
  const size_t length = track.Length();
  modified_.insert(model_.AddPoint3D(xyz, std::move(track)));
  return length;
}

// The keypoint observes the point of that match whose ray it is nearest to. 1 if it does.
size_t Triangulator::Continue(const Sight& sight) {
  if (sight.Keypoint().HasPoint3D()) return 0;
  double least_error = std::numeric_limits<double>::max();
  Point3DId nearest = kInvalidPoint3DId;
  for (const Sight& match : matches_) {
    const Point2D& point2D = match.Keypoint();
    if (!point2D.HasPoint3D()) continue;
    const double error =
        CalculateAngularError(sight.Keypoint().XY(), model_.Point3D(point2D.Point3DId()).XYZ(),
                              sight.image->Qvec(), sight.image->Tvec(), *sight.camera);
    if (!(error < least_error)) continue;
    least_error = error;
    nearest = point2D.Point3DId();
  }
  if (least_error > DegToRad(kMaxContinueErrorDeg)) return 0;
  model_.AddObservation(nearest, sight.Element());
  modified_.insert(nearest);
  return 1;
}

size_t Triangulator::CompleteTracks(const std::unordered_set<Point3DId>& ids) {
  Begin();
  size_t num_added = 0;
  for (const Point3DId id : ids) num_added += Complete(id);
  return num_added;
}

size_t Triangulator::Complete(Point3DId id) {
  if (!model_.ExistsPoint3D(id)) return 0;
  size_t num_added = 0;
  std::vector<TrackElement> ends = model_.Point3D(id).Track().Elements();
  for (int step = 0; step < kMaxTransitivity && !ends.empty(); ++step) {
    std::vector<TrackElement> added;
    for (const TrackElement& end : ends) AddMatchesOf(id, end, &added);
    num_added += added.size();
    ends.swap(added);
  }
  return num_added;
}

void Triangulator::AddMatchesOf(Point3DId id, const TrackElement& from,
                                std::vector<TrackElement>* added) {
  for (const auto& match : graph_.FindCorrespondences(from.image_id, from.point2D_idx)) {
    const Image& image = model_.Image(match.image_id);
    if (!image.IsRegistered() || image.Point2D(match.point2D_idx).HasPoint3D() ||
        HasBogusParams(model_.Camera(image.CameraId()))) {
      continue;
    }
    const TrackElement element(match.image_id, match.point2D_idx);
    if (!IsSeenAt(element, model_.Point3D(id).XYZ(), limits::kMaxErrorPx)) continue;
    model_.AddObservation(id, element);
    modified_.insert(id);
    added->push_back(element);
  }
}

bool Triangulator::IsSeenAt(const TrackElement& element, const Eigen::Vector3d& xyz,
                            double max_error_px) const {
  const Image& image = model_.Image(element.image_id);
  return CalculateSquaredReprojectionError(
             image.Point2D(element.point2D_idx).XY(), xyz, image.Qvec(), image.Tvec(),
             model_.Camera(image.CameraId())) <= max_error_px * max_error_px;
}

size_t Triangulator::MergeTracks(const std::unordered_set<Point3DId>& ids) {
  Begin();
  size_t num_merged = 0;
  for (const Point3DId id : ids) num_merged += Merge(id);
  return num_merged;
}

// Merges with the first point that is the same, then goes on with the joined one.
size_t Triangulator::Merge(Point3DId id) {
  if (!model_.ExistsPoint3D(id)) return 0;
  for (const TrackElement& element : model_.Point3D(id).Track().Elements()) {
    for (const auto& match : graph_.FindCorrespondences(element.image_id, element.point2D_idx)) {
      const Image& image = model_.Image(match.image_id);
      if (!image.IsRegistered()) continue;
      const Point2D& point2D = image.Point2D(match.point2D_idx);
      const Point3DId other = point2D.Point3DId();
      if (!point2D.HasPoint3D() || other == id || IsTried(id, other)) continue;
      const size_t num_merged = MergeWith(id, other);
      if (num_merged > 0) return num_merged;
    }
  }
  return 0;
}

bool Triangulator::IsTried(Point3DId id, Point3DId other) const {
  const auto tried = tried_.find(id);
  return tried != tried_.end() && tried->second.count(other) > 0;
}

size_t Triangulator::MergeWith(Point3DId id, Point3DId other) {
  tried_[id].insert(other);
  tried_[other].insert(id);
  const Point3D& point1 = model_.Point3D(id);
  const Point3D& point2 = model_.Point3D(other);
  const double n1 = static_cast<double>(point1.Track().Length());
  const double n2 = static_cast<double>(point2.Track().Length());
  const Eigen::Vector3d xyz = (n1 * point1.XYZ() + n2 * point2.XYZ()) / (n1 + n2);
  for (const Point3D* point : {&point1, &point2}) {
    for (const TrackElement& element : point->Track().Elements()) {
      if (!IsSeenAt(element, xyz, limits::kMaxErrorPx)) return 0;
    }
  }
  const size_t num_merged = point1.Track().Length() + point2.Track().Length();
  const Point3DId joined = model_.MergePoints3D(id, other);
  modified_.erase(id);
  modified_.erase(other);
  modified_.insert(joined);
  const size_t num_further = Merge(joined);
  return num_further > 0 ? num_further : num_merged;
}

const std::unordered_set<Point3DId>& Triangulator::GetModifiedPoints3D() {
  for (auto it = modified_.begin(); it != modified_.end();) {
    it = model_.ExistsPoint3D(*it) ? std::next(it) : modified_.erase(it);
  }
  return modified_;
}

}  // namespace skein
