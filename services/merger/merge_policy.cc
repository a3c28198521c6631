#include "merger/merge_policy.h"

#include <algorithm>
#include <cmath>

#include "core/option_check.h"

namespace skein {

MergePolicy::Failures MergePolicy::FailuresOf(const SessionState& session) {
  Failures failures;
  const auto remember = [&failures](const Direction& direction, int num_shared_images) {
    Tried& tried = failures[direction];
    tried.num_shared_images = std::max(tried.num_shared_images, num_shared_images);
    ++tried.num_failures;
  };
  const int64_t since = session.last_drained_seq();
  for (const auto& [merge_id, merge] : session.merges()) {
    if (merge.latest().state != merge_t::UNDONE || merge_id < since) continue;
    const merge_t& ordered = merge.ordered();
    remember({ordered.source_id, ordered.target_id}, ordered.num_shared_images);
  }
  for (const merge_t& failed : session.failed_merges()) {
    if (failed.header.seq < since) continue;
    remember({failed.source_id, failed.target_id}, failed.num_shared_images);
    remember({failed.target_id, failed.source_id}, failed.num_shared_images);
  }
  return failures;
}

bool MergePolicy::WasTried(const Failures& failures, const Direction& direction,
                           int num_shared_images, bool finishing) const {
  const auto it = failures.find(direction);
  if (it == failures.end()) return false;
  const bool patient = !finishing && it->second.num_failures >= options_.patient_failures;
  const double needed = patient ? options_.patient_growth * it->second.num_shared_images
                                : it->second.num_shared_images + 1.0;
  return num_shared_images < needed;
}

Status MergeOptions::Check() const {
  return FirstError({InRange("min_shared_images", min_shared_images, 3, 1000),
                     InRange("min_shared_when_finishing", min_shared_when_finishing, 1, 1000),
                     InRange("patient_failures", patient_failures, 1, 1'000'000),
                     InRange("patient_growth", patient_growth, 1.0, 1000.0)});
}

std::optional<MergeAttempt> MergePolicy::Next(const SubmapDirectory& directory,
                                              bool finishing) const {
  if (!options_.enabled) return std::nullopt;
  const int min_shared =
      finishing ? options_.min_shared_when_finishing : options_.min_shared_images;
  const SessionState& session = directory.session();
  const Failures failures = FailuresOf(session);
  std::optional<MergeAttempt> best;
  for (const auto& [pair, images] : directory.SharedPhotos()) {
    const int num_shared = static_cast<int>(images.size());
    if (num_shared < min_shared || directory.IsBusy(pair.first) || directory.IsBusy(pair.second)) {
      continue;
    }
    if (best && images.size() <= best->shared_images.size()) continue;
    const bool a_is_smaller = session.FindSubmap(pair.first)->num_registered <
                              session.FindSubmap(pair.second)->num_registered;
    const Direction first = a_is_smaller ? pair : Direction{pair.second, pair.first};
    for (const Direction& direction : {first, Direction{first.second, first.first}}) {
      if (WasTried(failures, direction, num_shared, finishing)) continue;
      best = MergeAttempt{direction.first, direction.second, images, session.last_drained_seq()};
      break;
    }
  }
  return best;
}

}  // namespace skein
