#include "session/session_state.h"

#include <algorithm>
#include <stdexcept>

#include "core/hash.h"

namespace skein {
namespace {

constexpr char kVanished[] = "vanished/";

}  // namespace

std::string RefusalId(const std::string& agent, const std::string& name,
                      const std::string& blob_id) {
  const std::string offer = agent + '\0' + name + '\0' + blob_id;
  return "refused/" + HashBytes(offer.data(), offer.size());
}

std::string VanishedId(const std::string& blob_id, int64_t finish_id) {
  return kVanished + blob_id + "/" + std::to_string(finish_id);
}

void SessionState::Apply(const Fact& fact) {
  const fact_header_t& header = Header(fact);
  if (header.seq != head_seq_ + 1) {
    throw std::logic_error("fact " + std::to_string(header.seq) + " after " +
                           std::to_string(head_seq_));
  }
  head_seq_ = header.seq;
  last_utime_us_ = header.utime_us;
  fact_ids_[header.fact_id] = header.seq;
  std::visit([this](const auto& f) { ApplyFact(f); }, fact);
}

int64_t SessionState::FindFact(const std::string& fact_id) const {
  const auto found = fact_ids_.find(fact_id);
  return found == fact_ids_.end() ? 0 : found->second;
}

const PhotoState* SessionState::FindPhoto(int64_t image_id) const {
  const auto found = photos_.find(image_id);
  return found == photos_.end() ? nullptr : &found->second;
}

PhotoState* SessionState::Photo(int64_t image_id) {
  return const_cast<PhotoState*>(FindPhoto(image_id));
}

int64_t SessionState::FindImageByBlob(const std::string& blob_id) const {
  const auto found = image_by_blob_.find(blob_id);
  return found == image_by_blob_.end() ? 0 : found->second;
}

int64_t SessionState::FindImageByName(const std::string& agent, const std::string& name) const {
  const auto found = image_by_name_.find({agent, name});
  return found == image_by_name_.end() ? 0 : found->second;
}

const SubmapState* SessionState::FindSubmap(int64_t submap_id) const {
  const auto found = submaps_.find(submap_id);
  return found == submaps_.end() ? nullptr : &found->second;
}

bool SessionState::IsLive(int64_t submap_id) const {
  const SubmapState* submap = FindSubmap(submap_id);
  return submap != nullptr && !submap->ended;
}

bool SessionState::IsRegistered(const PhotoState& photo) const {
  return std::any_of(photo.in_submap.begin(), photo.in_submap.end(), [&](const auto& in) {
    return in.second.state == registration_t::REGISTERED && IsLive(in.first);
  });
}

std::string SessionState::WhyUnregistered(const PhotoState& photo) const {
  if (photo.failed()) return photo.failed_reason;
  if (photo.features_seq == 0) return "waits for its features";
  if (photo.num_keypoints == 0) return "no features";
  if (photo.candidates_seq == 0) return "waits for its candidates";
  if (photo.matches_seq == 0) return "waits for its matches";
  for (auto in = photo.in_submap.rbegin(); in != photo.in_submap.rend(); ++in) {
    if (IsLive(in->first) && !in->second.reason.empty()) return in->second.reason;
  }
  return photo.num_pairs == 0 ? "no photo overlaps it" : "no submap could take it";
}

std::vector<failure_t> SessionState::Failures() const {
  std::vector<failure_t> failures;
  for (const auto& [seq, failure] : failures_) {
    if (failure.image_id == 0 || failure.parked) failures.push_back(failure);
  }
  return failures;
}

const failure_t* SessionState::FindFailure(const std::string& fact_id) const {
  const auto found = failure_by_id_.find(fact_id);
  return found == failure_by_id_.end() ? nullptr : &failures_.at(found->second);
}

// Counts the photo once when the change brings it through matching.
template <class Change>
void SessionState::ChangePhoto(int64_t image_id, Change change) {
  PhotoState* photo = Photo(image_id);
  if (photo == nullptr) return;
  const bool before = photo->through_matching();
  change(photo);
  num_through_ += photo->through_matching() - before;
}

void SessionState::ApplyFact(const image_t& fact) {
  photos_[fact.image_id].image = fact;
  image_by_blob_[fact.blob_id] = fact.image_id;
  image_by_name_[{fact.agent, fact.name}] = fact.image_id;
  num_cameras_ = std::max(num_cameras_, fact.camera_id);
  AddTime("ingest", static_cast<float>(fact.header.utime_us - fact.received_utime_us) * 1e-6f);
  // It came after all.
  const std::string prefix = kVanished + fact.blob_id;
  for (auto failure = failures_.begin(); failure != failures_.end();) {
    const std::string& id = failure->second.header.fact_id;
    if (id.compare(0, prefix.size(), prefix) != 0) {
      ++failure;
      continue;
    }
    failure_by_id_.erase(id);
    failure = failures_.erase(failure);
  }
}

void SessionState::ApplyFact(const features_t& fact) {
  ChangePhoto(fact.image_id, [&](PhotoState* photo) {
    photo->features_seq = fact.header.seq;
    photo->num_keypoints = fact.num_keypoints;
  });
  AddTime("features", fact.local_s + fact.global_s);
  AddTime("features.local", fact.local_s);
  AddTime("features.global", fact.global_s);
}

void SessionState::ApplyFact(const candidates_t& fact) {
  ChangePhoto(fact.image_id, [&](PhotoState* photo) { photo->candidates_seq = fact.header.seq; });
  unmatched_candidates_[fact.image_id] = fact.other_ids;
  AddTime("retrieval", fact.insert_s + fact.query_s);
  AddTime("retrieval.insert", fact.insert_s);
  AddTime("retrieval.query", fact.query_s);
}

void SessionState::CountHits(const matches_t& fact) {
  retrieval_.pairs_matched += fact.num_tried;
  retrieval_.pairs_verified += fact.num_pairs;
  const auto found = unmatched_candidates_.find(fact.image_id);
  if (found == unmatched_candidates_.end()) return;
  const std::vector<int64_t>& candidates = found->second;
  retrieval_.candidates += static_cast<int64_t>(candidates.size());
  for (const two_view_t& pair : fact.pairs) {
    retrieval_.hits += std::count(candidates.begin(), candidates.end(), pair.other_id);
  }
  unmatched_candidates_.erase(found);
}

void SessionState::ApplyFact(const matches_t& fact) {
  ChangePhoto(fact.image_id, [&](PhotoState* photo) {
    photo->matches_seq = fact.header.seq;
    photo->num_pairs = fact.num_pairs;
  });
  // A later photo's verified pairs are pairs of the earlier ones, too.
  for (const two_view_t& pair : fact.pairs) {
    ChangePhoto(pair.other_id, [](PhotoState* photo) { ++photo->num_pairs; });
  }
  CountHits(fact);
  AddTime("matching", fact.match_s + fact.verify_s);
  AddTime("matching.match", fact.match_s);
  AddTime("matching.verify", fact.verify_s);
}

void SessionState::ApplyFact(const registration_t& fact) {
  PhotoState* photo = Photo(fact.image_id);
  if (photo == nullptr) return;
  photo->in_submap[fact.submap_id] = {fact.state, fact.reason};
  if (fact.state != registration_t::REGISTERED) return;
  if (photo->registered_utime_us == 0) {
    photo->registered_utime_us = fact.header.utime_us;
    photo->registered_submap_id = fact.submap_id;
  }
  AddTime("mapper", fact.total_s);
  AddTime("mapper.register", fact.register_s);
  AddTime("mapper.triangulate", fact.triangulate_s);
  AddTime("mapper.local_ba", fact.local_ba_s);
}

void SessionState::ApplyFact(const submap_t& fact) {
  SubmapState& submap = submaps_[fact.submap_id];
  if (fact.state == submap_t::ASSIGNED) {
    submap.epoch = fact.epoch;
    submap.owner = fact.owner;
  }
  if (!fact.model_blob.empty()) submap.model = fact;
  if (fact.state == submap_t::FINAL) submap.final_ledger_seq = fact.ledger_seq;
  if (fact.state == submap_t::ENDED) {
    submap.ended = true;
    submap.end_reason = fact.reason;
  }
}

void SessionState::ApplyFact(const seed_t& fact) { submaps_[fact.submap_id].seed = fact; }

void SessionState::ApplyFact(const merge_t& fact) {
  if (fact.state == merge_t::FAILED) return;
  MergeState& merge = merges_[fact.merge_id];
  if (fact.state == merge_t::ORDERED) merge.ordered = fact;
  merge.latest = fact;
  const bool open = fact.state == merge_t::ORDERED || fact.state == merge_t::FROZEN;
  for (const int64_t submap_id : {merge.ordered.source_id, merge.ordered.target_id}) {
    submaps_[submap_id].open_merge_id = open ? fact.merge_id : 0;
  }
  if (!open) AddTime("merge", fact.duration_s);
}

void SessionState::ApplyFact(const failure_t& fact) {
  failures_[fact.header.seq] = fact;
  failure_by_id_[fact.header.fact_id] = fact.header.seq;
  if (fact.image_id == 0 || !fact.parked) return;
  ChangePhoto(fact.image_id, [&](PhotoState* photo) {
    photo->failed_stage = fact.stage;
    photo->failed_reason = fact.reason;
  });
}

void SessionState::ApplyFact(const finish_t& fact) {
  finish_.state = fact.state;
  if (fact.state == finish_t::REQUESTED) {
    finish_ = {fact.finish_id, fact.state, fact.detail, fact.header.utime_us, 0, 0};
  } else if (fact.state == finish_t::DRAINED) {
    finish_.drained_seq = fact.header.seq;
  } else if (fact.state == finish_t::SETTLED) {
    finish_.settled_seq = fact.header.seq;
  }
}

void SessionState::ApplyFact(const configuration_t& fact) {
  configurations_[{fact.service, fact.text, fact.version}].insert(fact.instance);
}

}  // namespace skein
