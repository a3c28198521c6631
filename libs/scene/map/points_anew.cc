#include "map/points_anew.h"

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <numeric>
#include <unordered_map>
#include <utility>
#include <vector>

#include "core/threads.h"
#include "map/map_access.h"
#include "sfm/model_io.h"

namespace skein {
namespace {

// Connected components of the keypoints of all photos, by their matches (union by path halving).
class KeypointComponents {
 public:
  KeypointComponents(const ImagePairs& pairs, const SceneMap& map) {
    size_t num_keypoints = 0;
    for (const ImageId id : map.photos()) {
      begin_[id] = num_keypoints;
      num_keypoints += map.reconstruction().Image(id).NumPoints2D();
    }
    parent_.resize(num_keypoints);
    std::iota(parent_.begin(), parent_.end(), size_t{0});
    is_matched_.resize(num_keypoints);
    for (const auto& [id1, id2] : pairs) {
      for (const FeatureMatch& match : map.MatchesOfPair(id1, id2)) {
        parent_[Find(id1, match.point2D_idx1)] = Find(id2, match.point2D_idx2);
        is_matched_[begin_.at(id1) + match.point2D_idx1] = true;
        is_matched_[begin_.at(id2) + match.point2D_idx2] = true;
      }
    }
  }

  size_t Find(ImageId id, Point2DIdx index) {
    size_t i = begin_.at(id) + index;
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  bool IsMatched(ImageId id, Point2DIdx index) const { return is_matched_[begin_.at(id) + index]; }

 private:
  std::unordered_map<ImageId, size_t> begin_;
  std::vector<size_t> parent_;
  std::vector<bool> is_matched_;
};

// The photos and poses of a map without its points; the keypoints and matches of some components.
// A photo's keypoints keep their order.
class Part {
 public:
  explicit Part(const Reconstruction& model) {
    for (const auto& [id, camera] : model.Cameras()) model_.AddCamera(camera);
  }

  // Its keypoints in this part, ascending.
  void AddImage(const Image& from, std::vector<Point2DIdx> keypoints) {
    Image image;
    image.SetImageId(from.ImageId());
    image.SetCameraId(from.CameraId());
    image.SetQvec(from.Qvec());
    image.SetTvec(from.Tvec());
    std::vector<Eigen::Vector2d> points;
    for (const Point2DIdx i : keypoints) points.push_back(from.Point2D(i).XY());
    image.SetPoints2D(points);
    model_.AddImage(std::move(image));
    if (from.IsRegistered()) model_.RegisterImage(from.ImageId());
    graph_.AddImage(from.ImageId(), points.size());
    keypoints_[from.ImageId()] = std::move(keypoints);
  }

  // By the keypoints of this part.
  void AddMatches(ImageId id1, ImageId id2, const FeatureMatches& matches) {
    if (!matches.empty()) graph_.AddCorrespondences(id1, id2, matches);
  }

  void Triangulate(ImageId id) { Triangulator(&graph_, &model_).TriangulateImage(id); }

  void CopyPointsTo(Reconstruction* model) const {
    for (const Point3DId id : AscendingPoints(model_)) {
      const Point3D& point = model_.Point3D(id);
      Track track;
      for (const TrackElement& element : point.Track().Elements()) {
        track.AddElement(element.image_id, keypoints_.at(element.image_id)[element.point2D_idx]);
      }
      model->AddPoint3D(point.XYZ(), std::move(track));
    }
  }

 private:
  Reconstruction model_;
  CorrespondenceGraph graph_;
  std::unordered_map<ImageId, std::vector<Point2DIdx>> keypoints_;  // in the map
};

// Whatever the number of threads, so that the points and their ids do not depend on it.
constexpr int kNumParts = 4;

std::vector<Part> Divide(const ImagePairs& pairs, const SceneMap& map) {
  KeypointComponents components(pairs, map);
  std::vector<Part> parts;
  parts.reserve(kNumParts);
  for (int i = 0; i < kNumParts; ++i) parts.emplace_back(map.reconstruction());
  std::unordered_map<ImageId, std::vector<Point2DIdx>> index_in_part;
  for (const ImageId id : map.photos()) {
    const Image& image = map.reconstruction().Image(id);
    std::vector<std::vector<Point2DIdx>> keypoints(kNumParts);
    std::vector<Point2DIdx>& index = index_in_part[id];
    index.resize(image.NumPoints2D());
    for (Point2DIdx i = 0; i < image.NumPoints2D(); ++i) {
      if (!components.IsMatched(id, i)) continue;
      std::vector<Point2DIdx>& of_part = keypoints[components.Find(id, i) % kNumParts];
      index[i] = static_cast<Point2DIdx>(of_part.size());
      of_part.push_back(i);
    }
    for (int i = 0; i < kNumParts; ++i) parts[i].AddImage(image, std::move(keypoints[i]));
  }
  std::vector<FeatureMatches> shares(kNumParts);
  for (const auto& [id1, id2] : pairs) {
    for (FeatureMatches& share : shares) share.clear();
    const std::vector<Point2DIdx>& index1 = index_in_part.at(id1);
    const std::vector<Point2DIdx>& index2 = index_in_part.at(id2);
    for (const FeatureMatch& match : map.MatchesOfPair(id1, id2)) {
      shares[components.Find(id1, match.point2D_idx1) % kNumParts].emplace_back(
          index1[match.point2D_idx1], index2[match.point2D_idx2]);
    }
    for (int i = 0; i < kNumParts; ++i) parts[i].AddMatches(id1, id2, shares[i]);
  }
  return parts;
}

// Photos that threads have done.
class DoneCount {
 public:
  void Add() {
    const std::lock_guard<std::mutex> lock(mutex_);
    ++done_;
    grown_.notify_one();
  }
  void WaitFor(size_t count) {
    std::unique_lock<std::mutex> lock(mutex_);
    grown_.wait(lock, [&] { return done_ >= count; });
  }

 private:
  std::mutex mutex_;
  std::condition_variable grown_;
  size_t done_ = 0;  // guarded by mutex_
};

std::vector<ImageId> RegisteredByName(const Reconstruction& model) {
  std::vector<ImageId> images = model.RegImageIds();
  std::sort(images.begin(), images.end(),
            [&](ImageId a, ImageId b) { return model.Image(a).Name() < model.Image(b).Name(); });
  return images;
}

}  // namespace

bool TriangulateAnew(int num_threads, SceneMap* map, const std::function<bool()>& stop) {
  return TriangulateAnew(num_threads, map->pairs(), map, stop);
}

bool TriangulateAnew(int num_threads, const ImagePairs& pairs, SceneMap* map,
                     const std::function<bool()>& stop) {
  std::vector<Part> parts = Divide(pairs, *map);
  const std::vector<ImageId> order = RegisteredByName(map->reconstruction());
  std::atomic<bool> stopped = false;
  DoneCount others;
  const int num_used = std::clamp(num_threads, 1, kNumParts);
  RunOnThreads(num_used, [&](int thread) {
    const bool asks = thread == 0 && stop;
    size_t num_own = 0;
    for (int i = thread; i < kNumParts; i += num_used) {
      for (const ImageId id : order) {
        if (asks && stop()) stopped = true;
        if (stopped) return;
        parts[i].Triangulate(id);
        ++num_own;
        if (thread > 0) others.Add();
      }
    }
    const size_t num_of_others = asks ? kNumParts * order.size() - num_own : 0;
    for (size_t n = 1; n <= num_of_others && !stopped; ++n) {
      others.WaitFor(n);
      stopped = stop();
    }
  });
  if (stopped) return false;
  Reconstruction& model = MapAccess::Model(map);
  for (const Point3DId id : model.Point3DIds()) model.DeletePoint3D(id);
  for (const Part& part : parts) part.CopyPointsTo(&model);
  map->ForgetModifiedPoints();
  return true;
}

}  // namespace skein
