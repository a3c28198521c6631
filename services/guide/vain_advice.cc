#include "guide/vain_advice.h"

#include <iterator>

#include "session/diagnosis.h"

namespace skein {
namespace {

constexpr size_t kMaxTaken = 5000;  // photos that are remembered

// Then it tells nothing of where it was taken.
bool IsSpoiled(const SessionState& state, const PhotoState& photo) {
  const Diagnosis::Cause cause = Diagnose(state, photo).cause;
  return cause == Diagnosis::Cause::kTooDark || cause == Diagnosis::Cause::kTooBright ||
         cause == Diagnosis::Cause::kBlurred;
}

bool IsInVain(const SessionState& state, int64_t image_id) {
  const PhotoState* photo = state.FindPhoto(image_id);
  if (photo == nullptr || state.IsRegistered(image_id)) return false;
  const bool is_alone = photo->matches_seq > 0 && state.covisibility().EdgesOf(image_id).empty();
  if (state.FindTrial(image_id) == nullptr && !is_alone) return false;
  return !IsSpoiled(state, *photo);
}

}  // namespace

void VainAdvice::NoteAdvice(int64_t submap_id, const AgentAdvice& advice) {
  Told& told = told_[advice.agent];
  told = {};
  told.submap_id = submap_id;
  for (const AdvisedStation& advised : advice.stations) {
    told.stations.push_back({advised.station.cam_from_world, advised.station.common_points});
  }
}

void VainAdvice::NotePhoto(const std::string& agent, int64_t image_id) {
  const auto told = told_.find(agent);
  if (told == told_.end() || told->second.num_taken >= told->second.stations.size()) return;
  const VainPhoto& photo = told->second.stations[told->second.num_taken++];
  taken_[image_id] = {agent, told->second.submap_id, photo, false};
  if (taken_.size() > kMaxTaken) taken_.erase(taken_.begin());
}

int64_t VainAdvice::NoteOutcome(const SessionState& state, int64_t image_id) {
  const auto taken = taken_.find(image_id);
  if (taken == taken_.end()) return 0;
  const bool in_vain = IsInVain(state, image_id);
  if (in_vain == taken->second.in_vain) return 0;
  taken->second.in_vain = in_vain;
  return taken->second.submap_id;
}

void VainAdvice::Drop(int64_t submap_id) {
  for (auto told = told_.begin(); told != told_.end();) {
    told = told->second.submap_id == submap_id ? told_.erase(told) : std::next(told);
  }
  for (auto taken = taken_.begin(); taken != taken_.end();) {
    taken = taken->second.submap_id == submap_id ? taken_.erase(taken) : std::next(taken);
  }
}

std::vector<VainPhoto> VainAdvice::Of(const std::string& agent, int64_t submap_id) const {
  std::vector<VainPhoto> photos;
  for (const auto& [image_id, taken] : taken_) {
    if (taken.in_vain && taken.agent == agent && taken.submap_id == submap_id) {
      photos.push_back(taken.photo);
    }
  }
  return photos;
}

}  // namespace skein
