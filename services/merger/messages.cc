#include "merger/messages.h"

#include <algorithm>

#include "session/merge_similarity.h"

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

}  // namespace skein
