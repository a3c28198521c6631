#include "texture/triangle_photos.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

#include "core/threads.h"

namespace skein {
namespace {

// A seam at one side of a triangle costs as much as this part of the best photo's score.
constexpr float kSeam = 0.2f;
constexpr int kMostPasses = 30;

class TriangleViewer {
 public:
  TriangleViewer(const SurfaceMesh& mesh, const std::vector<ColouredMap>& maps, size_t triangle)
      : maps_(maps) {
    for (int k = 0; k < 3; ++k) {
      corners_[k] = mesh.Position(mesh.vertices[mesh.indices[3 * triangle + k]]);
    }
    normal_ = (corners_[1] - corners_[0]).cross(corners_[2] - corners_[0]).normalized();
  }

  TriangleViews Views() const {
    TriangleViews views;
    for (size_t i = 0; i < maps_.size(); ++i) {
      const float score = ScoreIn(maps_[i]);
      if (score > 0) Insert(static_cast<int32_t>(i), score, &views);
    }
    return views;
  }

 private:
  // The least of the corners; not positive: the photo does not show the triangle.
  float ScoreIn(const ColouredMap& map) const {
    const DepthPose& pose = map.map->cam_from_world;
    const Eigen::Vector3d normal = pose.rotation * normal_;
    float least = std::numeric_limits<float>::infinity();
    for (const Eigen::Vector3d& corner : corners_) {
      const Eigen::Vector3d in_camera = pose.ToCamera(corner);
      const double cosine = -normal.dot(in_camera) / in_camera.norm();
      if (!(cosine > 0)) return 0;
      const auto pixel = PixelThatShows(map, in_camera);
      if (!pixel) return 0;
      least = std::min(least, ViewScore(*map.map, *pixel, in_camera.z(), cosine));
    }
    return least;
  }

  static void Insert(int32_t photo, float score, TriangleViews* views) {
    int at = std::min(views->count, TriangleViews::kMost - 1);
    if (views->count == TriangleViews::kMost && score <= views->score[at]) return;
    views->count = std::min(views->count + 1, TriangleViews::kMost);
    for (; at > 0 && views->score[at - 1] < score; --at) {
      views->score[at] = views->score[at - 1];
      views->photo[at] = views->photo[at - 1];
    }
    views->score[at] = score;
    views->photo[at] = photo;
  }

  const std::vector<ColouredMap>& maps_;
  std::array<Eigen::Vector3d, 3> corners_;
  Eigen::Vector3d normal_;
};

}  // namespace

std::vector<TriangleViews> ViewsOf(const SurfaceMesh& mesh, const std::vector<ColouredMap>& maps,
                                   int num_threads) {
  std::vector<TriangleViews> views(static_cast<size_t>(mesh.NumTriangles()));
  ForEachOnThreads(num_threads, views.size(),
                   [&](size_t i) { views[i] = TriangleViewer(mesh, maps, i).Views(); });
  return views;
}

std::vector<int32_t> NeighboursOf(const SurfaceMesh& mesh) {
  std::vector<std::tuple<uint32_t, uint32_t, int32_t>> sides;  // corners, ascending; 3 t + k
  sides.reserve(mesh.indices.size());
  for (size_t at = 0; at < mesh.indices.size(); ++at) {
    const size_t next = at % 3 == 2 ? at - 2 : at + 1;
    const auto [low, high] = std::minmax(mesh.indices[at], mesh.indices[next]);
    sides.emplace_back(low, high, static_cast<int32_t>(at));
  }
  std::sort(sides.begin(), sides.end());
  std::vector<int32_t> neighbours(mesh.indices.size(), -1);
  for (size_t i = 0; i + 1 < sides.size(); ++i) {
    const auto& [low, high, side] = sides[i];
    const auto& [next_low, next_high, next] = sides[i + 1];
    if (low != next_low || high != next_high) continue;
    neighbours[side] = next / 3;
    neighbours[next] = side / 3;
    ++i;  // where more than two meet, they are neighbours by pairs
  }
  return neighbours;
}

// Iterated conditional modes (Besag 1986), from the best photo of each.
std::vector<int32_t> ChoosePhotos(const std::vector<TriangleViews>& views,
                                  const std::vector<int32_t>& neighbours) {
  std::vector<int32_t> chosen;
  for (const TriangleViews& of : views) chosen.push_back(of.count > 0 ? of.photo[0] : -1);
  const auto cost = [&](size_t triangle, int view) {
    const TriangleViews& of = views[triangle];
    float sum = 1 - of.score[view] / of.score[0];
    for (size_t k = 0; k < 3; ++k) {
      const int32_t neighbour = neighbours[3 * triangle + k];
      if (neighbour >= 0 && chosen[neighbour] != of.photo[view]) sum += kSeam;
    }
    return sum;
  };
  bool is_changed = true;
  for (int pass = 0; pass < kMostPasses && is_changed; ++pass) {
    is_changed = false;
    for (size_t i = 0; i < views.size(); ++i) {
      int best = 0;
      for (int view = 1; view < views[i].count; ++view) {
        if (cost(i, view) < cost(i, best)) best = view;
      }
      if (views[i].count == 0 || chosen[i] == views[i].photo[best]) continue;
      chosen[i] = views[i].photo[best];
      is_changed = true;
    }
  }
  return chosen;
}

}  // namespace skein
