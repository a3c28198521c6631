#include "mapping/global_map.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <utility>
#include <vector>

#include "core/clock.h"
#include "core/log.h"
#include "core/threads.h"
#include "geometry/rotation_averaging.h"
#include "map/bundle_builder.h"
#include "map/filters.h"
#include "map/image_pose.h"
#include "map/points_anew.h"
#include "mapping/global_positions.h"
#include "mapping/registration.h"
#include "sfm/pose.h"
#include "sfm/random.h"
#include "sfm/robust_model.h"
#include "sfm/two_view_geometry.h"

namespace skein {
namespace {

// Matches that are enough for a relative rotation.
constexpr size_t kMaxMatches = 300;

Eigen::Vector2d Normalized(const SceneMap& map, ImageId id, Point2DIdx index) {
  const Image& image = map.reconstruction().Image(id);
  return map.reconstruction().Camera(image.CameraId()).ImageToWorld(image.Point2D(index).XY());
}

// The weight is the number of inliers; 0 where too few agree.
RelativeRotation EstimateRotation(const SceneMap& map, ImageId id1, ImageId id2) {
  const FeatureMatches matches = map.MatchesOfPair(id1, id2);
  const size_t count = std::min(matches.size(), kMaxMatches);
  std::vector<Eigen::Vector2d> points1, points2;
  for (size_t i = 0; i < count; ++i) {
    const FeatureMatch& match = matches[i * matches.size() / count];
    points1.push_back(Normalized(map, id1, match.point2D_idx1));
    points2.push_back(Normalized(map, id2, match.point2D_idx2));
  }
  const auto camera = [&](ImageId id) -> const Camera& {
    return map.reconstruction().Camera(map.reconstruction().Image(id).CameraId());
  };
  RelativeRotation rotation{id1, id2, Eigen::Matrix3d::Identity(), 0};
  RansacLimits limits;
  limits.max_error = NormalizedError(camera(id1), camera(id2), limits::kMaxErrorPx);
  limits.min_inlier_ratio = 0.25;
  limits.max_num_trials = 1000;
  SetRandomSeed(SeedFromIds(id1, id2));
  const RobustModel E = SearchEssential(limits, Sampling::kUniform, points1, points2);
  if (!E.found) return rotation;
  std::vector<Eigen::Vector2d> inliers1, inliers2;
  for (size_t i = 0; i < count; ++i) {
    if (!E.inlier_mask[i]) continue;
    inliers1.push_back(points1[i]);
    inliers2.push_back(points2[i]);
  }
  Eigen::Vector3d t;
  std::vector<Eigen::Vector3d> points3D;
  PoseFromEssentialMatrix(E.matrix, inliers1, inliers2, &rotation.R, &t, &points3D);
  const double num_inliers =
      static_cast<double>(inliers1.size()) * matches.size() / std::max<size_t>(1, count);
  if (num_inliers >= limits::kMinPoseInliers) rotation.weight = num_inliers;
  return rotation;
}

std::vector<RelativeRotation> EstimateRotations(const SubmapOptions& options,
                                                const std::set<ImageId>& without,
                                                const SceneMap& map) {
  std::vector<RelativeRotation> rotations;
  for (const auto& [id1, id2] : map.pairs()) {
    if (without.count(id1) > 0 || without.count(id2) > 0) continue;
    if (map.Neighbours(id1).at(id2) < limits::kMinPoseInliers) continue;
    rotations.push_back({id1, id2, Eigen::Matrix3d::Identity(), 0});
  }
  ForEachOnThreads(options.num_threads, rotations.size(), [&](size_t i) {
    if (!options.IsStopped())
      rotations[i] = EstimateRotation(map, rotations[i].id1, rotations[i].id2);
  });
  const auto is_unknown = [](const RelativeRotation& rotation) { return rotation.weight == 0; };
  rotations.erase(std::remove_if(rotations.begin(), rotations.end(), is_unknown), rotations.end());
  return rotations;
}

struct Feature {
  ImageId image_id;
  Point2DIdx index;
};
using FeatureTrack = std::vector<Feature>;  // by image, each once

// Features that belong together by the matches, surest pairs first. A match that would make a photo
// show a track twice is false, or an earlier one is: it is passed over.
class TrackBuilder {
 public:
  explicit TrackBuilder(const SceneMap& map) : map_(map) {
    for (const ImageId id : map.photos()) {
      begin_[id] = track_of_.size();
      track_of_.resize(track_of_.size() + map.reconstruction().Image(id).NumPoints2D(), kNone);
    }
  }

  void AddPair(ImageId id1, ImageId id2) {
    for (const FeatureMatch& match : map_.MatchesOfPair(id1, id2)) {
      Join(TrackOf({id1, match.point2D_idx1}), TrackOf({id2, match.point2D_idx2}));
    }
  }

  // Those of at least three photos, longest first.
  std::vector<FeatureTrack> Take() {
    std::vector<FeatureTrack> tracks;
    for (FeatureTrack& track : tracks_) {
      if (track.size() >= 3) tracks.push_back(std::move(track));
    }
    tracks_.clear();
    std::stable_sort(
        tracks.begin(), tracks.end(),
        [](const FeatureTrack& a, const FeatureTrack& b) { return a.size() > b.size(); });
    return tracks;
  }

 private:
  static constexpr size_t kNone = static_cast<size_t>(-1);

  size_t& EntryOf(const Feature& feature) {
    return track_of_[begin_.at(feature.image_id) + feature.index];
  }

  size_t TrackOf(const Feature& feature) {
    size_t& track = EntryOf(feature);
    if (track == kNone) {
      track = tracks_.size();
      tracks_.push_back({feature});
    }
    return track;
  }

  void Join(size_t a, size_t b) {
    if (a == b) return;
    if (tracks_[a].size() < tracks_[b].size()) std::swap(a, b);
    const auto by_image = [](const Feature& x, const Feature& y) {
      return x.image_id < y.image_id;
    };
    FeatureTrack joined;
    std::merge(tracks_[a].begin(), tracks_[a].end(), tracks_[b].begin(), tracks_[b].end(),
               std::back_inserter(joined), by_image);
    const auto twice = std::adjacent_find(
        joined.begin(), joined.end(),
        [](const Feature& x, const Feature& y) { return x.image_id == y.image_id; });
    if (twice != joined.end()) return;
    for (const Feature& feature : tracks_[b]) EntryOf(feature) = a;
    tracks_[a] = std::move(joined);
    tracks_[b].clear();
  }

  const SceneMap& map_;
  std::map<ImageId, size_t> begin_;
  std::vector<size_t> track_of_;  // of each keypoint of all photos
  std::vector<FeatureTrack> tracks_;
};

std::vector<FeatureTrack> FindTracks(const SceneMap& map, std::vector<RelativeRotation> pairs) {
  std::stable_sort(pairs.begin(), pairs.end(),
                   [](const auto& a, const auto& b) { return a.weight > b.weight; });
  TrackBuilder builder(map);
  for (const RelativeRotation& pair : pairs) builder.AddPair(pair.id1, pair.id2);
  return builder.Take();
}

// Some tracks of each photo are enough.
std::vector<PointRays> RaysOf(const SceneMap& map, const RotationAveraging& averaging,
                              const std::vector<FeatureTrack>& tracks) {
  constexpr int kTracksOfPhoto = 100;
  std::map<ImageId, int> num_tracks;
  std::vector<PointRays> points;
  for (const FeatureTrack& track : tracks) {
    const bool is_wanted = std::any_of(track.begin(), track.end(), [&](const Feature& feature) {
      return num_tracks[feature.image_id] < kTracksOfPhoto;
    });
    if (!is_wanted) continue;
    PointRays point;
    for (const Feature& feature : track) {
      ++num_tracks[feature.image_id];
      const Eigen::Vector3d ray = Normalized(map, feature.image_id, feature.index).homogeneous();
      point.rays.push_back({feature.image_id, averaging.rotations.at(feature.image_id).transpose() *
                                                  ray.normalized()});
    }
    points.push_back(std::move(point));
  }
  return points;
}

void RegisterAt(const RotationAveraging& averaging,
                const std::map<uint32_t, Eigen::Vector3d>& centers, SceneMap* map) {
  for (const auto& [id, center] : centers) {
    const Eigen::Matrix3d& R = averaging.rotations.at(id);
    map->SetPose(id, RotationMatrixToQuaternion(R), -R * center);
    map->Register(id);
  }
}

// Pairs of registered photos whose matches agree with the poses. Of the points of other pairs, as
// of two equal sides of an object, some would fit poses that they bend.
ImagePairs PairsThatFit(int num_threads, const SceneMap& map) {
  const auto is_placed = [&](const auto& pair) {
    return map.IsRegistered(pair.first) && map.IsRegistered(pair.second);
  };
  ImagePairs pairs;
  std::copy_if(map.pairs().begin(), map.pairs().end(), std::back_inserter(pairs), is_placed);
  std::vector<char> fits(pairs.size());
  ForEachOnThreads(num_threads, pairs.size(), [&](size_t i) {
    const auto& [id1, id2] = pairs[i];
    fits[i] = EpipolarVotes(map, id1, id2).AgreeingShare() >= kMinEpipolarShare;
  });
  ImagePairs fitting;
  for (size_t i = 0; i < pairs.size(); ++i) {
    if (fits[i]) fitting.push_back(pairs[i]);
  }
  return fitting;
}

// Rounds with ever smaller limits, as poses that come from directions are off by some pixels.
void AdjustCoarseToFine(const SubmapOptions& options, SceneMap* map) {
  for (const double factor : {8.0, 4.0, 2.0, 1.0}) {
    if (options.IsStopped()) return;
    const ImagePairs fitting = PairsThatFit(options.num_threads, *map);
    TriangulateAnew(options.num_threads, fitting, map);
    Bundle bundle = BuildGlobalBundle(*map, true);
    BundleOptions solve;
    solve.num_threads = options.num_threads;
    solve.loss_scale_px = factor;
    solve.stop = options.stop;
    if (!SolveWithPossibleIntrinsics(solve, map->reconstruction(), &bundle).usable) return;
    ApplyBundle(bundle, map);
    FilterPoints(AllPoints(*map), map, factor * limits::kMaxErrorPx);
    LogInfo("global: {} pairs fit, {} points, {} observations, error {:.2f} px", fitting.size(),
            map->reconstruction().NumPoints3D(), map->reconstruction().ComputeNumObservations(),
            map->reconstruction().ComputeMeanReprojectionError());
  }
}

struct AveragedPairs {
  RotationAveraging averaging;
  std::vector<RelativeRotation> fitting;
};

AveragedPairs AveragePairs(const SubmapOptions& options, const std::set<ImageId>& without,
                           const SceneMap& map) {
  constexpr double kMaxRotationErrorDeg = 10;
  Timer timer;
  const std::vector<RelativeRotation> relative = EstimateRotations(options, without, map);
  AveragedPairs pairs;
  pairs.averaging = AverageRotations(relative, kMaxRotationErrorDeg);
  for (size_t i = 0; i < relative.size(); ++i) {
    if (pairs.averaging.fits[i]) pairs.fitting.push_back(relative[i]);
  }
  LogInfo("global: {} of {} pairs fit, {} rotations ({:.2f} s)", pairs.fitting.size(),
          relative.size(), pairs.averaging.rotations.size(), timer.ElapsedS());
  return pairs;
}

void PlaceGlobally(const SubmapOptions& options, const AveragedPairs& pairs, SceneMap* map) {
  Timer timer;
  const std::vector<FeatureTrack> tracks = FindTracks(*map, pairs.fitting);
  const std::vector<PointRays> rays = RaysOf(*map, pairs.averaging, tracks);
  const auto centers = FindPositions(rays, options.num_threads, options.stop);
  LogInfo("global: {} of {} tracks, {} positions ({:.2f} s)", rays.size(), tracks.size(),
          centers.size(), timer.ElapsedS());
  if (options.IsStopped()) return;
  RegisterAt(pairs.averaging, centers, map);
  AdjustCoarseToFine(options, map);
}

}  // namespace

void ClearButIntrinsics(SceneMap* map) {
  std::map<CameraId, Camera> found;
  std::set<CameraId> apart;
  for (const auto& [id, state] : map->camera_states()) {
    if (map->HaveItsPhotosOwnCameras(id)) apart.insert(id);
    const Camera& camera = map->reconstruction().Camera(id);
    const bool is_told = state.refined || state.num_registered > 0;
    if (is_told && HasPossibleIntrinsics(camera)) found[id] = camera;
  }
  map->Clear();
  for (const ImageId id : map->photos()) {
    if (apart.count(map->GivenCamera(id)) > 0) map->GiveOwnCamera(id);
  }
  for (const auto& [id, camera] : found) {
    map->SetCamera(camera);
    map->SetCameraRefined(id, true);
  }
}

void MapGlobally(const SubmapOptions& options, const std::set<ImageId>& without, SceneMap* map) {
  constexpr int kMaxRounds = 3;
  constexpr double kMinGain = 0.01;  // of fitting pairs, for another round
  AveragedPairs pairs = AveragePairs(options, without, *map);
  for (int round = 1; !options.IsStopped() && pairs.averaging.rotations.size() >= 3; ++round) {
    PlaceGlobally(options, pairs, map);
    if (round == kMaxRounds || options.IsStopped()) return;
    AveragedPairs next = AveragePairs(options, without, *map);
    if (static_cast<double>(next.fitting.size()) <
        (1 + kMinGain) * static_cast<double>(pairs.fitting.size())) {
      return;
    }
    pairs = std::move(next);
    ClearButIntrinsics(map);
  }
}

}  // namespace skein
