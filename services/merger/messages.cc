#include "merger/messages.h"

#include <algorithm>
#include <cmath>

namespace skein {

std::vector<VerifiedPair> PairsOf(const matches_t& matches) {
  std::vector<VerifiedPair> pairs;
  for (const two_view_t& pair : matches.pairs) {
    pairs.push_back({pair.other_id, pair.num_inliers, pair.tri_angle_rad, pair.forward_motion});
  }
  return pairs;
}

seed_t SeedMessage(const SeedChoice& choice) {
  seed_t seed{};
  const auto [first, second] = std::minmax(choice.image_id1, choice.image_id2);
  seed.header.fact_id = "seed/" + std::to_string(first) + "-" + std::to_string(second);
  seed.image_id1 = choice.image_id1;
  seed.image_id2 = choice.image_id2;
  seed.num_inliers = choice.num_inliers;
  seed.tri_angle_rad = static_cast<float>(choice.tri_angle_rad);
  return seed;
}

merge_t AttemptMessage(const MergeAttempt& attempt, const SubmapDirectory& directory,
                       const Sim3Result& result, double duration_s) {
  merge_t merge{};
  merge.state = result.success ? merge_t::ORDERED : merge_t::FAILED;
  merge.header.fact_id =
      "merge/" + std::to_string(attempt.source_id) + "-" + std::to_string(attempt.target_id) + "/" +
      std::to_string(attempt.shared_images.size()) + "/" + std::to_string(attempt.drained_seq) +
      (result.success ? "/ordered" : "/failed");
  merge.source_id = attempt.source_id;
  merge.target_id = attempt.target_id;
  merge.source_epoch = directory.Find(attempt.source_id)->epoch;
  merge.target_epoch = directory.Find(attempt.target_id)->epoch;
  SetSimilarity(result.target_from_source, &merge);
  merge.num_shared_images = static_cast<int32_t>(attempt.shared_images.size());
  merge.num_inlier_images = static_cast<int32_t>(result.inlier_image_ids.size());
  merge.reason = result.reason;
  merge.duration_s = static_cast<float>(duration_s);
  return merge;
}

PendingMerge PendingOf(const merge_t& ordered) {
  return {ordered.merge_id, ordered.source_id, ordered.target_id, ordered.num_shared_images};
}

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

}  // namespace skein
