#include "matching/photo_matches.h"

#include <algorithm>
#include <unordered_map>
#include <unordered_set>

namespace skein {
namespace {

std::array<double, 9> RowMajor(const Eigen::Matrix3d& matrix) {
  std::array<double, 9> out;
  Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(out.data()) = matrix;
  return out;
}

TwoViewPair ToTwoViewPair(int64_t other_id, const TwoViewGeometry& geometry) {
  TwoViewPair pair;
  pair.other_id = other_id;
  pair.geometry = static_cast<int8_t>(geometry.config);
  pair.E = RowMajor(geometry.E);
  pair.F = RowMajor(geometry.F);
  pair.H = RowMajor(geometry.H);
  Eigen::Map<Eigen::Vector4d>(pair.qvec.data()) = geometry.qvec;
  Eigen::Map<Eigen::Vector3d>(pair.tvec.data()) = geometry.tvec;
  pair.tri_angle_rad = static_cast<float>(geometry.tri_angle);
  pair.forward_motion = static_cast<float>(ForwardMotion(geometry));
  for (const FeatureMatch& match : geometry.inlier_matches) {
    pair.inliers.emplace_back(match.point2D_idx1, match.point2D_idx2);
  }
  return pair;
}

bool ComesBefore(const TwoViewPair& a, const TwoViewPair& b) {
  if (a.inliers.size() != b.inliers.size()) return a.inliers.size() > b.inliers.size();
  return a.other_id < b.other_id;
}

bool IsApart(const CovisibilityGraph::Edge& edge) {
  return edge.IsEpipolar() && edge.num_inliers >= limits::kMinSeedInliers;
}

}  // namespace

std::vector<PairApart> PairsApart(const CovisibilityGraph& graph,
                                  const std::vector<int64_t>& image_ids) {
  const std::unordered_set<int64_t> wanted(image_ids.begin(), image_ids.end());
  std::vector<PairApart> pairs;
  for (const int64_t id : wanted) {
    for (const CovisibilityGraph::Edge& edge : graph.EdgesOf(id)) {
      if (edge.other_id > id && wanted.count(edge.other_id) > 0 && IsApart(edge)) {
        pairs.push_back({id, edge.other_id, edge.num_inliers});
      }
    }
  }
  return pairs;
}

void PhotoMatches::Add(int64_t other_id, const PairResult& result) {
  ++num_tried;
  match_s += result.product_s;
  verify_s += result.geometry_s;
  if (!IsVerified(result.geometry) && !result.evidence.of_moving) return;
  other_ids_.push_back(other_id);
  added_.push_back({result.geometry, result.stand_still, result.evidence});
}

void PhotoMatches::LeaveOutBackgroundOf(const std::vector<PairApart>& apart) {
  std::unordered_map<int64_t, PairWithEvidence*> still;
  for (size_t i = 0; i < added_.size(); ++i) {
    if (IsStill(added_[i])) still.emplace(other_ids_[i], &added_[i]);
  }
  const auto num_inliers = [&](int64_t id) -> size_t {
    const auto pair = still.find(id);
    return pair == still.end() ? 0 : pair->second->geometry.inlier_matches.size();
  };
  const bool is_background = std::any_of(apart.begin(), apart.end(), [&](const PairApart& pair) {
    return std::min(num_inliers(pair.id1), num_inliers(pair.id2)) >
           static_cast<size_t>(pair.num_inliers);
  });
  if (!is_background) return;
  for (const auto& [id, pair] : still) KeepMoving(pair);
}

void PhotoMatches::Conclude(const std::vector<Eigen::Vector2d>& points,
                            const std::vector<PairApart>& apart) {
  LeaveOutOverlay(points, &added_);
  LeaveOutBackgroundOf(apart);
  for (size_t i = 0; i < added_.size(); ++i) {
    const TwoViewGeometry& geometry = added_[i].geometry;
    if (IsVerified(geometry)) pairs.push_back(ToTwoViewPair(other_ids_[i], geometry));
  }
  std::sort(pairs.begin(), pairs.end(), ComesBefore);
  other_ids_.clear();
  added_.clear();
}

}  // namespace skein
