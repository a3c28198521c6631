#include "mapper/offered_photos.h"

#include "session/photo_homes.h"

namespace skein {

void OfferedPhotos::NoteAllHeld() {
  if (!one_home_) return;
  for (const auto& [submap_id, submap] : session_.submaps()) NoteHeldBy(submap);
}

void OfferedPhotos::OnFact(const Fact& fact) {
  if (!one_home_) return;
  std::visit([this](const auto& f) { React(f); }, fact);
}

void OfferedPhotos::React(const registration_t& registration) {
  const SubmapLife& submap = *session_.FindSubmap(registration.submap_id);
  if (submap.num_registered <= kMinHolder) NoteHeldBy(submap);  // all of them may be held now
  NoteHeld(registration.image_id);
  Review(registration.image_id);
  for (const auto& pair : session_.covisibility().EdgesOf(registration.image_id)) {
    Review(pair.other_id);
  }
}

// The end of a merge's source follows the merge's in one commit.
void OfferedPhotos::React(const submap_end_t& end) {
  NoteHeldBy(*session_.FindSubmap(end.submap_id));
  for (const auto& [image_id, unused] : offered_) Review(image_id);
}

void OfferedPhotos::NoteHeldBy(const SubmapLife& submap) {
  for (const auto& [image_id, unused] : submap.photos) {
    NoteHeld(image_id);
    Review(image_id);
  }
}

void OfferedPhotos::NoteHeld(int64_t image_id) {
  const bool before = held_elsewhere_.count(image_id) > 0;
  const bool now = HeldElsewhere(session_, image_id, submap_id_) != 0;
  if (now == before) return;
  now ? (void)held_elsewhere_.insert(image_id) : (void)held_elsewhere_.erase(image_id);
  held_changed_.insert(image_id);
}

void OfferedPhotos::Offer(int64_t image_id) {
  if (!offered_.emplace(image_id, false).second) return;
  Review(image_id);
}

void OfferedPhotos::Review(int64_t image_id) {
  const auto offered = offered_.find(image_id);
  if (offered == offered_.end()) return;
  if (held_elsewhere_.count(image_id) > 0) {
    ours_.erase(image_id);
    offered->second = false;
    return;
  }
  if (offered->second || !IsOurs(image_id)) return;
  offered->second = true;
  ours_.insert(image_id);
}

// Nobody's home: the registrations that support it here are on their way to the ledger, or everyone
// has turned it down, and something has changed since.
bool OfferedPhotos::IsOurs(int64_t image_id) const {
  if (!one_home_) return true;
  const int64_t home = HomeOf(session_, image_id);
  return home == submap_id_ || home == 0;
}

std::vector<int64_t> OfferedPhotos::TakeOurs() {
  std::vector<int64_t> ids(ours_.begin(), ours_.end());
  ours_.clear();
  return ids;
}

std::vector<std::pair<int64_t, bool>> OfferedPhotos::TakeHeldChanges() {
  std::vector<std::pair<int64_t, bool>> changes;
  for (const int64_t id : held_changed_) changes.emplace_back(id, held_elsewhere_.count(id) > 0);
  held_changed_.clear();
  return changes;
}

}  // namespace skein
