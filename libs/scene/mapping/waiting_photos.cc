#include "mapping/waiting_photos.h"

#include <algorithm>
#include <utility>

namespace skein {
namespace {

constexpr int kMaxWithdrawals = 2;  // of one photo; the third time it is rejected

}  // namespace

int WaitingPhotos::CountVisible(ImageId id) const {
  return static_cast<int>(FindVisiblePoints(map_, id).size());
}

bool WaitingPhotos::MayBeTried(int64_t image_id) const {
  return map_.HasPhoto(image_id) && !map_.IsRegistered(image_id) && !IsHeldElsewhere(image_id) &&
         left_out_.count(image_id) == 0;
}

void WaitingPhotos::LeaveOut(int64_t image_id) {
  left_out_.insert(image_id);
  queue_.erase(static_cast<ImageId>(image_id));
}

void WaitingPhotos::Enqueue(int64_t image_id) {
  if (!MayBeTried(image_id)) return;
  const ImageId id = static_cast<ImageId>(image_id);
  if (records_[id].rejected) return;
  queue_[id] = CountVisible(id);
}

void WaitingPhotos::EnqueueNeighbours(ImageId id) {
  for (const auto& [other, inliers] : map_.Neighbours(id)) {
    if (!MayBeTried(other)) continue;
    const TrialRecord& record = records_[other];
    if (record.rejected) continue;
    const int visible = CountVisible(other);
    if (queue_.count(other) > 0 || !record.deferred || visible > record.last_visible) {
      queue_[other] = visible;
    }
  }
}

void WaitingPhotos::SetHeldElsewhere(int64_t image_id, bool held) {
  if (!held) {
    held_elsewhere_.erase(image_id);
    return;
  }
  held_elsewhere_.insert(image_id);
  queue_.erase(static_cast<ImageId>(image_id));
}

std::optional<ImageId> WaitingPhotos::TakeNext() {
  if (queue_.empty()) return std::nullopt;
  const auto next =
      std::max_element(queue_.begin(), queue_.end(),
                       [](const auto& a, const auto& b) { return a.second < b.second; });
  const ImageId id = next->first;
  queue_.erase(next);
  return id;
}

void WaitingPhotos::RetryDeferred() {
  for (const auto& [id, record] : records_) {
    if (!record.deferred || record.rejected || map_.IsRegistered(id)) continue;
    if (record.num_withdrawals > 0 && CountVisible(id) <= record.last_visible) continue;
    Enqueue(id);
  }
}

void WaitingPhotos::RetryAll() {
  for (auto& [id, record] : records_) {
    if (record.of_similar_place || map_.IsRegistered(id)) continue;
    record.rejected = false;
    record.num_withdrawals = 0;
  }
  RetryDeferred();
}

bool WaitingPhotos::OnDeferred(ImageId id) { return !std::exchange(records_[id].deferred, true); }

void WaitingPhotos::OnRegistered(ImageId id) {
  records_[id].deferred = records_[id].of_similar_place = false;
}

bool WaitingPhotos::OnWithdrawn(ImageId id) {
  TrialRecord& record = records_[id];
  record.deferred = true;
  record.last_visible = CountVisible(id);
  record.rejected = ++record.num_withdrawals > kMaxWithdrawals;
  return record.rejected;
}

void WaitingPhotos::OnReplaced(ImageId id) {
  queue_.erase(id);
  records_[id].deferred = false;
}

bool WaitingPhotos::IsOfSimilarPlace(ImageId id) const {
  const auto record = records_.find(id);
  return record != records_.end() && record->second.of_similar_place;
}

bool WaitingPhotos::MatchesSimilarPlace(ImageId id) const {
  const auto& neighbours = map_.Neighbours(id);
  return IsOfSimilarPlace(id) ||
         std::any_of(neighbours.begin(), neighbours.end(),
                     [this](const auto& n) { return IsOfSimilarPlace(n.first); });
}

int WaitingPhotos::NumDeferred() const {
  return static_cast<int>(std::count_if(records_.begin(), records_.end(), [this](const auto& r) {
    return r.second.deferred && !map_.IsRegistered(r.first);
  }));
}

void WaitingPhotos::ReplaceRecords(const std::map<ImageId, TrialRecord>& records) {
  std::map<ImageId, TrialRecord> replaced = records;
  for (auto& [id, record] : replaced) record.of_similar_place |= IsOfSimilarPlace(id);
  records_ = std::move(replaced);
  queue_.clear();
}

TrialContext WaitingPhotos::ContextOf(ImageId id) const {
  return {MatchesSimilarPlace(id), IsOfSimilarPlace(id)};
}

}  // namespace skein
