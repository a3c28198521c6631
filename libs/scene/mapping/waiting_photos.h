#pragma once

#include <map>
#include <optional>
#include <set>

#include "map/scene_map.h"
#include "mapping/registration.h"

namespace skein {

// Earlier trials of a photo, and their outcome.
struct TrialRecord {
  int last_visible = 0;  // points visible when it was last tried
  int num_withdrawals = 0;
  bool deferred = false;  // told so
  bool rejected = false;
  bool of_similar_place = false;  // withdrawn as of a visually similar place
};

// The photos that are not registered: what was tried with each, and which one is tried next.
class WaitingPhotos {
 public:
  // `map` must outlive this.
  explicit WaitingPhotos(const SceneMap& map) : map_(map) {}

  // Puts a photo that is there into the queue; ignored when it is registered, rejected or held
  // elsewhere.
  void Enqueue(int64_t image_id);
  // Puts neighbours of a photo into the queue that see more points than when they were last tried.
  void EnqueueNeighbours(ImageId id);
  void Dequeue(ImageId id) { queue_.erase(id); }
  // Another submap holds the photo: it is not tried here until that is over. May be called before
  // the photo is added.
  void SetHeldElsewhere(int64_t image_id, bool held);
  // The photo is never tried again. May be called before the photo is added.
  void LeaveOut(int64_t image_id);
  // There, not registered, and neither left out nor held elsewhere.
  bool MayBeTried(int64_t image_id) const;
  const std::set<int64_t>& left_out() const { return left_out_; }
  bool IsHeldElsewhere(int64_t image_id) const { return held_elsewhere_.count(image_id) > 0; }
  const std::set<int64_t>& held_elsewhere() const { return held_elsewhere_; }
  // Takes the photo that sees most points from the queue, the lowest id of equals; nullopt if the
  // queue is empty.
  std::optional<ImageId> TakeNext();

  // All deferred photos that are not rejected. A withdrawn photo only if it sees more points than
  // when it was withdrawn; for the others a refined map is new evidence.
  void RetryDeferred();
  // Rejected photos, too, but none of a visually similar place. A photo that closes a loop may wait
  // because the map was wrong.
  void RetryAll();

  // Outcomes of a photo's trial, which change its record.
  void OnTried(ImageId id, int num_visible) { records_[id].last_visible = num_visible; }
  bool OnDeferred(ImageId id);  // false if that was told before
  void OnRegistered(ImageId id);
  bool OnWithdrawn(ImageId id);  // true if it was withdrawn too often and is rejected now
  void OnReplaced(ImageId id);   // the photo is registered in a model from outside
  void MarkOfSimilarPlace(ImageId id) { records_[id].of_similar_place = true; }
  void ForgetVisible(ImageId id) { records_[id].last_visible = 0; }

  bool IsOfSimilarPlace(ImageId id) const;
  // Whether it, or a photo that it matches with, was found to be of a visually similar place.
  bool MatchesSimilarPlace(ImageId id) const;
  // Context of the photo's next trial.
  TrialContext ContextOf(ImageId id) const;
  int NumDeferred() const;

  const std::map<ImageId, TrialRecord>& records() const { return records_; }
  void set_records(std::map<ImageId, TrialRecord> records) { records_ = std::move(records); }
  // The records of a submap that was mapped again. A photo marked as of a similar place stays
  // marked. Empties the queue.
  void ReplaceRecords(const std::map<ImageId, TrialRecord>& records);

 private:
  int CountVisible(ImageId id) const;

  const SceneMap& map_;
  std::map<ImageId, TrialRecord> records_;
  std::map<ImageId, int> queue_;  // with the number of points it sees
  std::set<int64_t> held_elsewhere_;
  std::set<int64_t> left_out_;
};

}  // namespace skein
