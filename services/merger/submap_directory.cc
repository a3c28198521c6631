#include "merger/submap_directory.h"

#include <algorithm>

namespace skein {

SubmapEntry& SubmapDirectory::Entry(int64_t submap_id) {
  SubmapEntry& entry = submaps_[submap_id];
  entry.submap_id = submap_id;
  return entry;
}

void SubmapDirectory::OnSeed(int64_t submap_id, int64_t image_id1, int64_t image_id2) {
  SubmapEntry& entry = Entry(submap_id);
  entry.image_id1 = image_id1;
  entry.image_id2 = image_id2;
  seeds_.insert(std::minmax(image_id1, image_id2));
}

void SubmapDirectory::OnLeased(int64_t submap_id, int64_t epoch, const std::string& owner) {
  SubmapEntry& entry = Entry(submap_id);
  if (epoch <= entry.epoch) return;
  entry.epoch = epoch;
  entry.owner = owner;
  entry.ledger_seq = 0;
}

void SubmapDirectory::OnEnded(int64_t submap_id) {
  SubmapEntry& entry = Entry(submap_id);
  if (!entry.live) return;
  entry.live = false;
  for (const int64_t image_id : entry.registered) submaps_of_[image_id].erase(submap_id);
}

void SubmapDirectory::OnMerged(int64_t source_id, int64_t target_id) {
  SubmapEntry& source = Entry(source_id);
  if (!source.live) return;
  source.live = false;
  source.merged_into = target_id;
  for (const int64_t image_id : source.registered) {
    submaps_of_[image_id].erase(source_id);
    OnRegistered(target_id, image_id);
  }
}

void SubmapDirectory::OnRegistered(int64_t submap_id, int64_t image_id) {
  SubmapEntry& entry = Entry(submap_id);
  entry.deferred.erase(image_id);
  entry.registered.insert(image_id);
  if (entry.live) submaps_of_[image_id].insert(submap_id);
}

void SubmapDirectory::OnNotRegistered(int64_t submap_id, int64_t image_id, bool deferred) {
  SubmapEntry& entry = Entry(submap_id);
  entry.registered.erase(image_id);
  if (deferred) {
    entry.deferred.insert(image_id);
  } else {
    entry.deferred.erase(image_id);
  }
  submaps_of_[image_id].erase(submap_id);
}

void SubmapDirectory::OnStatus(int64_t submap_id, int64_t epoch, int64_t ledger_seq) {
  const auto it = submaps_.find(submap_id);
  if (it == submaps_.end() || epoch != it->second.epoch) return;
  it->second.ledger_seq = std::max(it->second.ledger_seq, ledger_seq);
}

const SubmapEntry* SubmapDirectory::Find(int64_t submap_id) const {
  const auto it = submaps_.find(submap_id);
  return it == submaps_.end() ? nullptr : &it->second;
}

std::vector<const SubmapEntry*> SubmapDirectory::Live() const {
  std::vector<const SubmapEntry*> live;
  for (const auto& [id, entry] : submaps_) {
    if (entry.live) live.push_back(&entry);
  }
  return live;
}

bool SubmapDirectory::IsRegistered(int64_t image_id) const {
  const auto it = submaps_of_.find(image_id);
  return it != submaps_of_.end() && !it->second.empty();
}

bool SubmapDirectory::IsDeferred(int64_t image_id) const {
  for (const SubmapEntry* entry : Live()) {
    if (entry->deferred.count(image_id)) return true;
  }
  return false;
}

bool SubmapDirectory::WasSeeded(int64_t image_id1, int64_t image_id2) const {
  return seeds_.count(std::minmax(image_id1, image_id2)) > 0;
}

std::map<SubmapDirectory::Pair, std::vector<int64_t>> SubmapDirectory::SharedPhotos() const {
  std::map<Pair, std::vector<int64_t>> shared;
  for (const auto& [image_id, submaps] : submaps_of_) {
    for (auto a = submaps.begin(); a != submaps.end(); ++a) {
      for (auto b = std::next(a); b != submaps.end(); ++b) shared[{*a, *b}].push_back(image_id);
    }
  }
  return shared;
}

}  // namespace skein
