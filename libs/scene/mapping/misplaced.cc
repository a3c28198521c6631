#include "mapping/misplaced.h"

#include <algorithm>
#include <set>
#include <utility>
#include <vector>

#include "core/limits.h"
#include "disambiguation/similar_structures.h"
#include "map/photos_around.h"
#include "mapping/registration.h"
#include "sfm/reprojection.h"

namespace skein {
namespace {

bool SeenAt(const Reconstruction& reconstruction, const Image& image, const Eigen::Vector2d& pixel,
            Point3DId id) {
  return CalculateSquaredReprojectionError(pixel, reconstruction.Point3D(id).XYZ(), image.Qvec(),
                                           image.Tvec(), reconstruction.Camera(image.CameraId())) <=
         limits::kMaxPoseErrorPx * limits::kMaxPoseErrorPx;
}

std::vector<TrackElement> TrackByImage(const Reconstruction& reconstruction, Point3DId id) {
  std::vector<TrackElement> track = reconstruction.Point3D(id).Track().Elements();
  std::sort(track.begin(), track.end(),
            [](const auto& a, const auto& b) { return a.image_id < b.image_id; });
  return track;
}

// Whether a photo shows two points apart: so they are not one, whatever was matched.
bool AreSeenApart(const Reconstruction& reconstruction, Point3DId id1, Point3DId id2) {
  constexpr double kMinPx = limits::kMaxPoseErrorPx;
  const auto pixel_of = [&](const TrackElement& element) {
    return reconstruction.Image(element.image_id).Point2D(element.point2D_idx).XY();
  };
  const std::vector<TrackElement> track1 = TrackByImage(reconstruction, id1),
                                  track2 = TrackByImage(reconstruction, id2);
  for (auto a = track1.begin(), b = track2.begin(); a != track1.end() && b != track2.end();) {
    if (a->image_id != b->image_id) {
      a->image_id < b->image_id ? ++a : ++b;
    } else if ((pixel_of(*a) - pixel_of(*b)).squaredNorm() > kMinPx * kMinPx) {
      return true;
    } else {
      ++a, ++b;
    }
  }
  return false;
}

std::vector<ImageId> Contradicted(const std::vector<ImageId>& ids,
                                  const std::vector<PhotoEdge>& edges) {
  PhotoGroups groups(ids, edges);
  groups.JoinByVotes(edges);
  return groups.Contradicted(kMinContradiction);
}

}  // namespace

Votes CountVotes(const SceneMap& map, ImageId id1, ImageId id2) {
  const Reconstruction& reconstruction = map.reconstruction();
  const Image& image1 = reconstruction.Image(id1);
  const Image& image2 = reconstruction.Image(id2);
  Votes votes;
  for (const auto& match : map.MatchesOfPair(id1, id2)) {
    const Point2D& keypoint1 = image1.Point2D(match.point2D_idx1);
    const Point2D& keypoint2 = image2.Point2D(match.point2D_idx2);
    if (!keypoint1.HasPoint3D() || !keypoint2.HasPoint3D()) continue;
    const bool agree = keypoint1.Point3DId() == keypoint2.Point3DId() ||
                       SeenAt(reconstruction, image2, keypoint2.XY(), keypoint1.Point3DId()) ||
                       SeenAt(reconstruction, image1, keypoint1.XY(), keypoint2.Point3DId());
    ++(agree ? votes.agree : votes.contradict);
  }
  if (!map.IsStrongPair(id1, id2, kMinPairShare)) votes.contradict = 0;
  return votes;
}

Votes CountCommonPoints(const SceneMap& map, ImageId id1, ImageId id2) {
  const Image& image1 = map.reconstruction().Image(id1);
  const Image& image2 = map.reconstruction().Image(id2);
  Votes votes;
  std::vector<std::pair<Point3DId, Point3DId>> contradicting;
  for (const auto& match : map.MatchesOfPair(id1, id2)) {
    const Point2D& keypoint1 = image1.Point2D(match.point2D_idx1);
    const Point2D& keypoint2 = image2.Point2D(match.point2D_idx2);
    if (!keypoint1.HasPoint3D() || !keypoint2.HasPoint3D()) continue;
    if (keypoint1.Point3DId() == keypoint2.Point3DId()) {
      ++votes.agree;
    } else {
      contradicting.emplace_back(keypoint1.Point3DId(), keypoint2.Point3DId());
    }
  }
  votes.contradict = static_cast<int>(contradicting.size());
  if (!IsTorn(votes)) return votes;
  votes.contradict -= static_cast<int>(
      std::count_if(contradicting.begin(), contradicting.end(), [&](const auto& points) {
        return AreSeenApart(map.reconstruction(), points.first, points.second);
      }));
  return votes;
}

bool IsTorn(const Votes& common_points) {
  constexpr int kMinMatches = 30;
  return common_points.Sum() >= kMinMatches &&
         10 * common_points.contradict > 3 * common_points.agree;
}

bool AreOfSimilarStructures(const SceneMap& map, const ImagePairs& pairs) {
  CellVotes votes;
  for (const auto& [id, other] : pairs) {
    const auto pose = EstimatePoseByPair(map, id, other);
    if (pose) votes.Add(CompareWithPhoto(map, id, *pose, other));
  }
  return ShowsAnotherPlace(votes);
}

bool OnlySimilarStructuresContradict(const SceneMap& map, const std::vector<ImageId>& photos) {
  ImagePairs pairs;
  for (const ImageId id : photos) {
    for (const auto& [other, inliers] : map.Neighbours(id)) {
      if (!map.IsRegistered(other) || std::binary_search(photos.begin(), photos.end(), other))
        continue;
      const Votes votes = CountVotes(map, id, other);
      if (votes.contradict > votes.agree) pairs.emplace_back(id, other);
    }
  }
  return AreOfSimilarStructures(map, pairs);
}

std::vector<ImageId> FindMisplaced(const SceneMap& map) {
  std::vector<PhotoEdge> edges;
  for (const auto& [id1, id2] : map.pairs()) {
    if (!map.IsRegistered(id1) || !map.IsRegistered(id2)) continue;
    edges.push_back({id1, id2, CountVotes(map, id1, id2)});
  }
  return Contradicted(map.reconstruction().RegImageIds(), edges);
}

std::vector<ImageId> FindMisplacedAround(const SceneMap& map, ImageId center, size_t max_photos) {
  const std::vector<ImageId> around = RegisteredAround(map, {center}, max_photos);
  const std::set<ImageId> ids(around.begin(), around.end());
  std::vector<PhotoEdge> edges;
  for (const ImageId id : ids) {
    for (const auto& [other, inliers] : map.Neighbours(id)) {
      if (other >= id || ids.count(other) == 0) continue;
      edges.push_back({id, other, CountVotes(map, id, other)});
    }
  }
  return Contradicted({ids.begin(), ids.end()}, edges);
}

}  // namespace skein
