#include "merger/submap_directory.h"

#include <algorithm>

namespace skein {

void SubmapDirectory::OnStatus(int64_t submap_id, int64_t epoch, int64_t ledger_seq) {
  const SubmapLife* submap = session_.FindSubmap(submap_id);
  if (submap == nullptr || epoch != submap->lease.epoch) return;
  Position& position = positions_[submap_id];
  if (position.epoch != epoch) position = {epoch, 0};
  position.ledger_seq = std::max(position.ledger_seq, ledger_seq);
}

int64_t SubmapDirectory::PositionOf(int64_t submap_id, const SubmapLife& submap) const {
  const auto found = positions_.find(submap_id);
  const bool known = found != positions_.end() && found->second.epoch == submap.lease.epoch;
  return known ? found->second.ledger_seq : 0;
}

std::vector<LiveSubmap> SubmapDirectory::Live() const {
  std::vector<LiveSubmap> live;
  for (const auto& [id, submap] : session_.submaps()) {
    if (!submap.ended) live.push_back({id, &submap, PositionOf(id, submap)});
  }
  return live;
}

bool SubmapDirectory::IsDeferred(int64_t image_id) const {
  for (const LiveSubmap& submap : Live()) {
    const auto photo = submap.state->photos.find(image_id);
    if (photo == submap.state->photos.end()) continue;
    const int8_t state = photo->second.state;
    if (state == registration_t::DEFERRED || state == registration_t::WITHDRAWN) return true;
  }
  return false;
}

bool SubmapDirectory::IsBusy(int64_t submap_id) const {
  const SubmapLife* submap = session_.FindSubmap(submap_id);
  return submap != nullptr && submap->open_merge_id != 0;
}

int SubmapDirectory::NumOpenMerges() const {
  const auto& merges = session_.merges();
  return static_cast<int>(std::count_if(merges.begin(), merges.end(), [&](const auto& entry) {
    const SubmapLife* source = session_.FindSubmap(entry.second.ordered().source_id);
    return source->open_merge_id == entry.first;
  }));
}

std::map<SubmapDirectory::Pair, std::vector<int64_t>> SubmapDirectory::SharedPhotos() const {
  const std::vector<LiveSubmap> live = Live();
  if (live.size() < 2) return {};
  std::map<int64_t, std::vector<int64_t>> submaps_of;  // photo -> submaps, by id
  for (const LiveSubmap& submap : live) {
    for (const auto& [image_id, photo] : submap.state->photos) {
      if (photo.state == registration_t::REGISTERED) {
        submaps_of[image_id].push_back(submap.submap_id);
      }
    }
  }
  std::map<Pair, std::vector<int64_t>> shared;
  for (const auto& [image_id, submaps] : submaps_of) {
    for (auto a = submaps.begin(); a != submaps.end(); ++a) {
      for (auto b = std::next(a); b != submaps.end(); ++b) shared[{*a, *b}].push_back(image_id);
    }
  }
  return shared;
}

}  // namespace skein
