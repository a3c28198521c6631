#include "mapper/ledger_index.h"

namespace skein {
namespace {

template <typename T>
const T* Find(const std::map<int64_t, T>& map, int64_t id) {
  const auto it = map.find(id);
  return it == map.end() ? nullptr : &it->second;
}

std::string CountKey(int64_t image_id, int64_t submap_id, int64_t epoch) {
  return std::to_string(image_id) + "/" + std::to_string(submap_id) + "/" + std::to_string(epoch);
}

}  // namespace

void LedgerIndex::Take(const Fact& fact) {
  if (const auto* image = std::get_if<image_t>(&fact)) images_[image->image_id] = *image;
  if (const auto* f = std::get_if<features_t>(&fact)) features_[f->image_id] = *f;
  if (const auto* c = std::get_if<candidates_t>(&fact)) candidates_[c->image_id] = *c;
  if (const auto* seed = std::get_if<seed_t>(&fact)) seeds_[seed->submap_id] = *seed;
  if (const auto* matches = std::get_if<matches_t>(&fact)) TakeMatches(*matches);
  if (const auto* submap = std::get_if<submap_t>(&fact)) TakeSubmap(*submap);
  if (const auto* merge = std::get_if<merge_t>(&fact)) TakeMerge(*merge);
  if (const auto* r = std::get_if<registration_t>(&fact)) TakeRegistration(*r);
}

void LedgerIndex::TakeMatches(const matches_t& matches) {
  matches_[matches.image_id] = matches;
  for (const two_view_t& pair : matches.pairs) {
    neighbours_[matches.image_id].emplace(pair.other_id, matches.header.seq);
    neighbours_[pair.other_id].emplace(matches.image_id, matches.header.seq);
  }
}

void LedgerIndex::TakeSubmap(const submap_t& submap) {
  const int64_t id = submap.submap_id;
  if (submap.state == submap_t::ASSIGNED) leases_[id] = submap;
  if (submap.state == submap_t::ENDED) ended_[id] = true;
  if (submap.state == submap_t::CHECKPOINT || submap.state == submap_t::FINAL) {
    models_[id] = submap;
  }
}

void LedgerIndex::TakeMerge(const merge_t& merge) {
  merges_[merge.state == merge_t::ORDERED ? merge.header.seq : merge.merge_id].push_back(merge);
}

void LedgerIndex::TakeRegistration(const registration_t& r) {
  registered_[r.submap_id][r.image_id] = r.state == registration_t::REGISTERED;
  ++num_registrations_[CountKey(r.image_id, r.submap_id, r.epoch)];
}

const image_t* LedgerIndex::FindImage(int64_t id) const { return Find(images_, id); }
const features_t* LedgerIndex::FindFeatures(int64_t id) const { return Find(features_, id); }
const candidates_t* LedgerIndex::FindCandidates(int64_t id) const { return Find(candidates_, id); }
const matches_t* LedgerIndex::FindMatches(int64_t id) const { return Find(matches_, id); }
const seed_t* LedgerIndex::FindSeed(int64_t submap_id) const { return Find(seeds_, submap_id); }
const submap_t* LedgerIndex::FindModel(int64_t submap_id) const { return Find(models_, submap_id); }
const submap_t* LedgerIndex::FindLease(int64_t submap_id) const { return Find(leases_, submap_id); }

const std::vector<merge_t>& LedgerIndex::FindMerge(int64_t merge_id) const {
  static const std::vector<merge_t> kNone;
  const auto it = merges_.find(merge_id);
  return it == merges_.end() ? kNone : it->second;
}

const std::map<int64_t, int64_t>& LedgerIndex::Neighbours(int64_t image_id) const {
  static const std::map<int64_t, int64_t> kNone;
  const auto it = neighbours_.find(image_id);
  return it == neighbours_.end() ? kNone : it->second;
}

std::vector<int64_t> LedgerIndex::RegisteredIn(int64_t submap_id) const {
  std::vector<int64_t> ids;
  const auto it = registered_.find(submap_id);
  if (it == registered_.end()) return ids;
  for (const auto& [id, registered] : it->second) {
    if (registered) ids.push_back(id);
  }
  return ids;
}

int LedgerIndex::CountRegistrations(int64_t image_id, int64_t submap_id, int64_t epoch) const {
  const auto it = num_registrations_.find(CountKey(image_id, submap_id, epoch));
  return it == num_registrations_.end() ? 0 : it->second;
}

}  // namespace skein
