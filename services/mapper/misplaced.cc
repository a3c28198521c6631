#include "mapper/misplaced.h"

#include <algorithm>
#include <set>
#include <unordered_map>

#include "base/projection.h"
#include "mapper/photo_groups.h"

namespace skein {
namespace {

bool SeenAt(const colmap::Reconstruction& reconstruction, const colmap::Image& image,
            const Eigen::Vector2d& pixel, Point3DId id, double max_error_px) {
  return colmap::CalculateSquaredReprojectionError(
             pixel, reconstruction.Point3D(id).XYZ(), image.Qvec(), image.Tvec(),
             reconstruction.Camera(image.CameraId())) <= max_error_px * max_error_px;
}

// Matches of which both keypoints have a point.
Votes CountVotes(const MisplacedOptions& options, const SceneMap& map, ImageId id1, ImageId id2) {
  const colmap::Reconstruction& reconstruction = map.reconstruction();
  const colmap::Image& image1 = reconstruction.Image(id1);
  const colmap::Image& image2 = reconstruction.Image(id2);
  Votes votes;
  for (const auto& match : map.graph().FindCorrespondencesBetweenImages(id1, id2)) {
    const colmap::Point2D& keypoint1 = image1.Point2D(match.point2D_idx1);
    const colmap::Point2D& keypoint2 = image2.Point2D(match.point2D_idx2);
    if (!keypoint1.HasPoint3D() || !keypoint2.HasPoint3D()) continue;
    const bool agree =
        keypoint1.Point3DId() == keypoint2.Point3DId() ||
        SeenAt(reconstruction, image2, keypoint2.XY(), keypoint1.Point3DId(),
               options.max_error_px) ||
        SeenAt(reconstruction, image1, keypoint1.XY(), keypoint2.Point3DId(), options.max_error_px);
    ++(agree ? votes.agree : votes.contradict);
  }
  return votes;
}

// Of photos in ascending order; `edges`: between them, as indices.
std::vector<ImageId> Contradicted(const MisplacedOptions& options, const std::vector<ImageId>& ids,
                                  const std::vector<PhotoEdge>& edges) {
  PhotoGroups groups(ids.size(), edges);
  groups.JoinByVotes(edges);
  std::vector<ImageId> misplaced;
  for (const int i : groups.Contradicted(options.min_contradiction)) misplaced.push_back(ids[i]);
  std::sort(misplaced.begin(), misplaced.end());
  return misplaced;
}

std::unordered_map<ImageId, int> IndexOf(const std::vector<ImageId>& ids) {
  std::unordered_map<ImageId, int> index;
  for (const ImageId id : ids) index.emplace(id, static_cast<int>(index.size()));
  return index;
}

// Breadth first along verified pairs, ascending.
std::vector<ImageId> RegisteredAround(const SceneMap& map, ImageId center, size_t max_photos) {
  std::vector<ImageId> found = {center};
  std::set<ImageId> seen = {center};
  for (size_t i = 0; i < found.size() && found.size() < max_photos; ++i) {
    for (const auto& [other, inliers] : map.Neighbours(found[i])) {
      if (found.size() >= max_photos) break;
      if (map.IsRegistered(other) && seen.insert(other).second) found.push_back(other);
    }
  }
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace

std::vector<ImageId> FindMisplaced(const MisplacedOptions& options, const SceneMap& map) {
  std::vector<ImageId> ids = map.reconstruction().RegImageIds();
  std::sort(ids.begin(), ids.end());
  const std::unordered_map<ImageId, int> index = IndexOf(ids);
  std::vector<PhotoEdge> edges;
  for (const auto& [id1, id2] : map.pairs()) {
    if (index.count(id1) == 0 || index.count(id2) == 0) continue;
    edges.push_back({index.at(id1), index.at(id2), CountVotes(options, map, id1, id2)});
  }
  return Contradicted(options, ids, edges);
}

std::vector<ImageId> FindMisplacedAround(const MisplacedOptions& options, const SceneMap& map,
                                         ImageId center) {
  const std::vector<ImageId> ids = RegisteredAround(map, center, options.max_photos_around);
  const std::unordered_map<ImageId, int> index = IndexOf(ids);
  std::vector<PhotoEdge> edges;
  for (const ImageId id : ids) {
    for (const auto& [other, inliers] : map.Neighbours(id)) {
      if (other >= id || index.count(other) == 0) continue;
      edges.push_back({index.at(id), index.at(other), CountVotes(options, map, id, other)});
    }
  }
  return Contradicted(options, ids, edges);
}

}  // namespace skein
