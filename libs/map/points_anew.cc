#include "map/points_anew.h"

#include <algorithm>
#include <atomic>
#include <numeric>
#include <unordered_map>
#include <utility>
#include <vector>

#include "core/threads.h"
#include "map/map_access.h"

namespace skein {
namespace {

// Connected components of the keypoints of all photos, by their matches (union by path halving).
class KeypointComponents {
 public:
  explicit KeypointComponents(const SceneMap& map) {
    size_t num_keypoints = 0;
    for (const ImageId id : map.photos()) {
      begin_[id] = num_keypoints;
      num_keypoints += map.reconstruction().Image(id).NumPoints2D();
    }
    parent_.resize(num_keypoints);
    std::iota(parent_.begin(), parent_.end(), size_t{0});
    for (const auto& [id1, id2] : map.pairs()) {
      for (const colmap::FeatureMatch& match : map.MatchesOfPair(id1, id2)) {
        parent_[Find(id1, match.point2D_idx1)] = Find(id2, match.point2D_idx2);
      }
    }
  }

  size_t Find(ImageId id, Point2DIdx index) {
    size_t i = begin_.at(id) + index;
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }

 private:
  std::unordered_map<ImageId, size_t> begin_;
  std::vector<size_t> parent_;
};

// The photos and poses of a map without its points, and the matches of some components.
class Part {
 public:
  explicit Part(const SceneMap& map) {
    const colmap::Reconstruction& model = map.reconstruction();
    for (const auto& [id, camera] : model.Cameras()) model_.AddCamera(camera);
    for (const ImageId id : map.photos()) AddImage(model.Image(id));
  }

  void AddMatches(ImageId id1, ImageId id2, const colmap::FeatureMatches& matches) {
    if (!matches.empty()) graph_.AddCorrespondences(id1, id2, matches);
  }

  // False where `stop` said so.
  bool Triangulate(const SceneMap::TriangulatorOptions& options, const std::vector<ImageId>& order,
                   const std::function<bool()>& stop) {
    colmap::IncrementalTriangulator triangulator(&graph_, &model_);
    for (const ImageId id : order) {
      if (stop()) return false;
      triangulator.TriangulateImage(options, id);
    }
    return true;
  }

  void MovePointsTo(colmap::Reconstruction* model) const {
    const auto ids = model_.Point3DIds();
    std::vector<Point3DId> ascending(ids.begin(), ids.end());
    std::sort(ascending.begin(), ascending.end());
    for (const Point3DId id : ascending) {
      const colmap::Point3D& point = model_.Point3D(id);
      model->AddPoint3D(point.XYZ(), point.Track());
    }
  }

 private:
  void AddImage(const colmap::Image& from) {
    colmap::Image image;
    image.SetImageId(from.ImageId());
    image.SetCameraId(from.CameraId());
    image.SetQvec(from.Qvec());
    image.SetTvec(from.Tvec());
    std::vector<Eigen::Vector2d> keypoints;
    for (const colmap::Point2D& keypoint : from.Points2D()) keypoints.push_back(keypoint.XY());
    image.SetPoints2D(keypoints);
    model_.AddImage(std::move(image));
    if (from.IsRegistered()) model_.RegisterImage(from.ImageId());
    graph_.AddImage(from.ImageId(), keypoints.size());
  }

  colmap::Reconstruction model_;
  colmap::CorrespondenceGraph graph_;
};

std::vector<Part> Divide(const SceneMap& map, int num_parts) {
  KeypointComponents components(map);
  std::vector<Part> parts;
  for (int i = 0; i < num_parts; ++i) parts.emplace_back(map);
  std::vector<colmap::FeatureMatches> shares(num_parts);
  for (const auto& [id1, id2] : map.pairs()) {
    for (colmap::FeatureMatches& share : shares) share.clear();
    for (const colmap::FeatureMatch& match : map.MatchesOfPair(id1, id2)) {
      shares[components.Find(id1, match.point2D_idx1) % num_parts].push_back(match);
    }
    for (int i = 0; i < num_parts; ++i) parts[i].AddMatches(id1, id2, shares[i]);
  }
  return parts;
}

std::vector<ImageId> RegisteredByName(const colmap::Reconstruction& model) {
  std::vector<ImageId> images = model.RegImageIds();
  std::sort(images.begin(), images.end(),
            [&](ImageId a, ImageId b) { return model.Image(a).Name() < model.Image(b).Name(); });
  return images;
}

}  // namespace

bool TriangulateAnew(const colmap::IncrementalTriangulator::Options& options, int num_threads,
                     SceneMap* map, const std::function<bool()>& stop) {
  std::vector<Part> parts = Divide(*map, std::max(1, num_threads));
  const std::vector<ImageId> order = RegisteredByName(map->reconstruction());
  std::atomic<bool> stopped = false;
  RunOnThreads(static_cast<int>(parts.size()), [&](int i) {
    const bool asks = i == 0 && stop;
    const auto is_stopped = [&] { return asks ? stop() : stopped.load(); };
    if (!parts[i].Triangulate(options, order, is_stopped)) stopped = true;
  });
  if (stopped) return false;
  colmap::Reconstruction& model = MapAccess::Model(map);
  for (const Point3DId id : model.Point3DIds()) model.DeletePoint3D(id);
  for (const Part& part : parts) part.MovePointsTo(&model);
  map->ForgetModifiedPoints();
  return true;
}

}  // namespace skein
