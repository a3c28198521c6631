#include "merger/merge_policy.h"

#include <algorithm>
#include <cmath>

namespace skein {

void MergePolicy::OnOrdered(const PendingMerge& merge) { pending_[merge.merge_id] = merge; }

void MergePolicy::OnDone(int64_t merge_id) { pending_.erase(merge_id); }

void MergePolicy::OnUndone(int64_t merge_id) {
  const auto it = pending_.find(merge_id);
  if (it == pending_.end()) return;
  const PendingMerge& merge = it->second;
  const bool precedes_drained = merge_id < drained_seq_;
  if (!precedes_drained) Remember({merge.source_id, merge.target_id}, merge.num_shared_images);
  pending_.erase(it);
}

void MergePolicy::OnDrained(int64_t seq) {
  drained_seq_ = seq;
  tried_.clear();
}

void MergePolicy::OnFailed(int64_t source_id, int64_t target_id, int num_shared_images) {
  Remember({source_id, target_id}, num_shared_images);
  Remember({target_id, source_id}, num_shared_images);
}

void MergePolicy::OnEnded(int64_t submap_id) {
  for (auto it = pending_.begin(); it != pending_.end();) {
    const bool over = it->second.source_id == submap_id || it->second.target_id == submap_id;
    it = over ? pending_.erase(it) : std::next(it);
  }
}

void MergePolicy::Remember(const Direction& direction, int num_shared_images) {
  Tried& tried = tried_[direction];
  tried.num_shared_images = std::max(tried.num_shared_images, num_shared_images);
  ++tried.num_failures;
}

bool MergePolicy::WasTried(const Direction& direction, int num_shared_images,
                           bool finishing) const {
  const auto it = tried_.find(direction);
  if (it == tried_.end()) return false;
  const bool patient = !finishing && it->second.num_failures >= options_.patient_failures;
  const double needed = patient ? options_.patient_growth * it->second.num_shared_images
                                : it->second.num_shared_images + 1.0;
  return num_shared_images < needed;
}

bool MergePolicy::IsBusy(int64_t submap_id) const {
  return std::any_of(pending_.begin(), pending_.end(), [&](const auto& entry) {
    return entry.second.source_id == submap_id || entry.second.target_id == submap_id;
  });
}

std::optional<MergeAttempt> MergePolicy::Next(const SubmapDirectory& directory,
                                              bool finishing) const {
  if (!options_.enabled) return std::nullopt;
  const int min_shared =
      finishing ? options_.min_shared_when_finishing : options_.min_shared_images;
  std::optional<MergeAttempt> best;
  for (const auto& [pair, images] : directory.SharedPhotos()) {
    const int num_shared = static_cast<int>(images.size());
    if (num_shared < min_shared || IsBusy(pair.first) || IsBusy(pair.second)) continue;
    if (best && images.size() <= best->shared_images.size()) continue;
    const SubmapEntry* a = directory.Find(pair.first);
    const SubmapEntry* b = directory.Find(pair.second);
    const bool a_is_smaller = a->registered.size() < b->registered.size();
    const Direction first = a_is_smaller ? pair : Direction{pair.second, pair.first};
    for (const Direction& direction : {first, Direction{first.second, first.first}}) {
      if (WasTried(direction, num_shared, finishing)) continue;
      best = MergeAttempt{direction.first, direction.second, images, drained_seq_};
      break;
    }
  }
  return best;
}

}  // namespace skein
