#include "session/merge_similarity.h"

#include <algorithm>
#include <cmath>

namespace skein {

void SetSimilarity(const Similarity& target_from_source, merge_t* merge) {
  const Eigen::Quaterniond& q = target_from_source.rotation;
  merge->target_from_source_scale = target_from_source.scale;
  const double wxyz[4] = {q.w(), q.x(), q.y(), q.z()};
  std::copy(wxyz, wxyz + 4, merge->target_from_source_qwxyz);
  const Eigen::Vector3d& t = target_from_source.translation;
  std::copy(t.data(), t.data() + 3, merge->target_from_source_xyz);
}

std::optional<Similarity> SimilarityOf(const merge_t& merge) {
  const double* q = merge.target_from_source_qwxyz;
  const Eigen::Quaterniond rotation(q[0], q[1], q[2], q[3]);
  const double scale = merge.target_from_source_scale;
  if (!std::isfinite(scale) || scale <= 0 || !(rotation.norm() > 0)) return std::nullopt;
  return Similarity{scale, rotation.normalized(), Eigen::Vector3d(merge.target_from_source_xyz)};
}

void SetSim3Options(const Sim3Options& options, merge_t* merge) {
  sim3_options_t& message = merge->sim3_options;
  message.min_inlier_ratio = options.min_inlier_ratio;
  message.max_reprojection_error_px = kMaxSim3ErrorPx;
  message.num_trials = kNumSim3Trials;
  message.min_inlier_images = options.min_inlier_images;
  message.min_common_points = options.min_common_points;
  message.max_scored_points = kMaxScoredPoints;
  message.seed = static_cast<int64_t>(options.seed);
}

Sim3Options Sim3OptionsOf(const merge_t& merge) {
  const sim3_options_t& message = merge.sim3_options;
  Sim3Options options;
  options.min_inlier_ratio = message.min_inlier_ratio;
  options.min_inlier_images = message.min_inlier_images;
  options.min_common_points = message.min_common_points;
  options.seed = static_cast<uint64_t>(message.seed);
  return options;
}

}  // namespace skein
