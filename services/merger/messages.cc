#include "merger/messages.h"

#include "ledger/fact_ids.h"
#include "session/merge_similarity.h"

namespace skein {

seed_t SeedMessage(const SeedChoice& choice) {
  seed_t seed{};
  seed.header.fact_id = SeedFactId(choice.image_id1, choice.image_id2);
  seed.image_id1 = choice.image_id1;
  seed.image_id2 = choice.image_id2;
  seed.num_inliers = choice.num_inliers;
  seed.tri_angle_rad = static_cast<float>(choice.tri_angle_rad);
  return seed;
}

merge_t AttemptMessage(const MergeAttempt& attempt, const SessionState& session,
                       const Sim3Result& result, const Sim3Options& options, double duration_s,
                       int64_t evidence_utime_us) {
  merge_t merge{};
  merge.state = result.success ? merge_t::ORDERED : merge_t::FAILED;
  merge.header.fact_id =
      MergeAttemptFactId(attempt.source_id, attempt.target_id, attempt.num_images,
                         attempt.drained_seq, result.success);
  merge.source_id = attempt.source_id;
  merge.target_id = attempt.target_id;
  merge.source_epoch = session.FindSubmap(attempt.source_id)->lease.epoch;
  merge.target_epoch = session.FindSubmap(attempt.target_id)->lease.epoch;
  SetSimilarity(result.target_from_source, &merge);
  SetSim3Options(options, &merge);
  merge.num_shared_images = attempt.num_images;
  merge.num_inlier_images = static_cast<int32_t>(result.inlier_image_ids.size());
  merge.reason = result.reason;
  merge.duration_s = static_cast<float>(duration_s);
  merge.evidence_utime_us = evidence_utime_us;
  return merge;
}

}  // namespace skein
