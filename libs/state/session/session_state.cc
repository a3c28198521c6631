#include "session/session_state.h"

#include <algorithm>
#include <iterator>

#include "core/attempt.h"
#include "core/finite.h"

namespace skein {

std::string MergedReason(int64_t target_id) {
  return "merged into map " + std::to_string(target_id);
}

bool SubmapLife::IsRegistered(int64_t image_id) const {
  const auto photo = photos.find(image_id);
  return photo != photos.end() && photo->second.state == registration_t::REGISTERED;
}

bool SubmapLife::IsLeftOut(const std::string& step) const {
  const auto failed = failed_steps.find(step);
  return failed != failed_steps.end() && failed->second.left_out;
}

void SessionState::Apply(const Fact& fact) {
  const fact_header_t& header = Header(fact);
  if (header.seq != head_seq_ + 1) {
    throw BrokenState("fact " + std::to_string(header.seq) + " after " + std::to_string(head_seq_));
  }
  head_seq_ = header.seq;
  last_utime_us_ = header.utime_us;
  ChangeWhole([&] { std::visit([this](const auto& f) { ApplyFact(f); }, fact); });
}

std::string PhotoName(const std::string& agent, const std::string& name) {
  return agent.empty() ? name : agent + "/" + name;
}

std::optional<TextureFields> TextureOf(const PhotoState& photo) {
  if (photo.features_seq == 0) return std::nullopt;
  TextureFields texture;
  static_assert(sizeof texture.bits == sizeof photo.features.texture);
  std::copy(std::begin(photo.features.texture), std::end(photo.features.texture),
            texture.bits.begin());
  return texture;
}

const PhotoState* SessionState::FindPhoto(int64_t image_id) const {
  const auto found = photos_.find(image_id);
  return found == photos_.end() ? nullptr : &found->second;
}

std::string SessionState::NameOf(int64_t image_id) const {
  const PhotoState* photo = FindPhoto(image_id);
  return photo == nullptr ? std::to_string(image_id)
                          : PhotoName(photo->image.agent, photo->image.name);
}

const SubmapLife* SessionState::FindSubmap(int64_t submap_id) const {
  const auto found = submaps_.find(submap_id);
  return found == submaps_.end() ? nullptr : &found->second;
}

const MergeState* SessionState::FindMerge(int64_t merge_id) const {
  const auto found = merges_.find(merge_id);
  return found == merges_.end() ? nullptr : &found->second;
}

bool SessionState::IsLive(int64_t submap_id) const {
  const SubmapLife* submap = FindSubmap(submap_id);
  return submap != nullptr && !submap->ended;
}

bool SessionState::WasSeeded(int64_t image_id1, int64_t image_id2) const {
  return seeded_.count(std::minmax(image_id1, image_id2)) > 0;
}

bool SessionState::IsInLiveSeed(int64_t image_id) const {
  return std::any_of(submaps_.begin(), submaps_.end(), [&](const auto& entry) {
    const SubmapLife& submap = entry.second;
    return !submap.ended &&
           (submap.seed.image_id1 == image_id || submap.seed.image_id2 == image_id);
  });
}

bool SessionState::IsRegistered(int64_t image_id) const {
  return std::any_of(submaps_.begin(), submaps_.end(), [&](const auto& entry) {
    return !entry.second.ended && entry.second.IsRegistered(image_id);
  });
}

std::vector<int64_t> SessionState::RegisteredIn(int64_t submap_id) const {
  std::vector<int64_t> ids;
  const SubmapLife* submap = FindSubmap(submap_id);
  if (submap == nullptr) return ids;
  for (const auto& [id, photo] : submap->photos) {
    if (photo.state == registration_t::REGISTERED) ids.push_back(id);
  }
  return ids;
}

const SubmapLife::Photo* SessionState::FindTrial(int64_t image_id) const {
  for (auto submap = submaps_.rbegin(); submap != submaps_.rend(); ++submap) {
    if (submap->second.ended) continue;
    const auto photo = submap->second.photos.find(image_id);
    if (photo != submap->second.photos.end()) return &photo->second;
  }
  return nullptr;
}

// Counts the photo once when the change brings it through matching.
template <class Change>
void SessionState::ChangePhoto(int64_t image_id, Change change) {
  const auto photo = photos_.find(image_id);
  if (photo == photos_.end()) return;
  const bool before = photo->second.through_matching();
  change(&photo->second);
  num_through_ += photo->second.through_matching() - before;
}

void SessionState::ApplyFact(const image_t& fact) {
  photos_[fact.image_id].image = fact;
  num_cameras_ = std::max(num_cameras_, fact.camera_id);
}

void SessionState::ApplyFact(const features_t& fact) {
  ChangePhoto(fact.image_id, [&](PhotoState* photo) {
    photo->features = fact;
    photo->features_seq = fact.header.seq;
  });
}

void SessionState::ApplyFact(const candidates_t& fact) {
  ChangePhoto(fact.image_id, [&](PhotoState* photo) {
    photo->candidates = fact;
    photo->candidates_seq = fact.header.seq;
  });
}

void SessionState::ApplyFact(const matches_t& fact) {
  ChangePhoto(fact.image_id, [&](PhotoState* photo) {
    if (photo->matches_seq == 0) photo->matches_order = ++num_matched_;
    photo->matches_seq = fact.header.seq;
    photo->pairs_blob = fact.pairs_blob;
  });
  for (const two_view_t& pair : fact.pairs) {
    covisibility_.Add(fact.image_id, {pair.other_id, pair.num_inliers, fact.header.seq,
                                      FiniteOrZero(pair.tri_angle_rad),
                                      FiniteOrZero(pair.forward_motion), pair.geometry});
  }
}

void SessionState::ApplyFact(const seed_t& fact) {
  SubmapLife& submap = submaps_[fact.submap_id];
  submap.seed = fact;
  submap.has_seed = true;
  seeded_.insert(std::minmax(fact.image_id1, fact.image_id2));
}

void SessionState::ApplyFact(const submap_lease_t& fact) {
  SubmapLife& submap = submaps_[fact.submap_id];
  submap.lease = fact;
}

void SessionState::ApplyFact(const registration_t& fact) {
  SubmapLife& submap = submaps_[fact.submap_id];
  const bool before = submap.IsRegistered(fact.image_id);
  submap.photos[fact.image_id] = {fact.state, fact.cause, fact.num_inliers, fact.reason};
  submap.num_registered += (fact.state == registration_t::REGISTERED) - before;
}

void SessionState::ApplyFact(const submap_model_t& fact) {
  SubmapLife& submap = submaps_[fact.submap_id];
  submap.latest_model = fact;
  if (fact.kind == submap_model_t::FINAL) submap.final_ledger_seq = fact.ledger_seq;
}

void SessionState::ApplyFact(const submap_end_t& fact) {
  EndSubmap(fact.submap_id, fact.reason, fact.merged_into);
}

void SessionState::EndSubmap(int64_t submap_id, const std::string& reason, int64_t merged_into) {
  SubmapLife& submap = submaps_[submap_id];
  submap.ended = true;
  submap.end_reason = reason;
  submap.merged_into = merged_into;
  if (submap.open_merge_id == 0) return;
  merges_.at(submap.open_merge_id).abandoned = true;
  CloseMerge(submap.open_merge_id);
}

// Either submap may be in a later merge by now, when the first one was closed by an end.
void SessionState::CloseMerge(int64_t merge_id) {
  const merge_t& ordered = merges_.at(merge_id).ordered();
  for (const int64_t submap_id : {ordered.source_id, ordered.target_id}) {
    int64_t& open = submaps_[submap_id].open_merge_id;
    if (open == merge_id) open = 0;
  }
}

void SessionState::ApplyFact(const merge_t& fact) {
  if (fact.state == merge_t::FAILED) {
    failed_merges_.push_back(fact);
    return;
  }
  MergeState& merge = merges_[fact.merge_id];
  merge.facts.push_back(fact);
  if (fact.state == merge_t::ORDERED) {
    submaps_[fact.source_id].open_merge_id = fact.merge_id;
    submaps_[fact.target_id].open_merge_id = fact.merge_id;
  }
  if (merge.is_open()) return;
  CloseMerge(fact.merge_id);
  if (fact.state == merge_t::DONE) {
    EndSubmap(fact.source_id, MergedReason(fact.target_id), fact.target_id);
  }
}

void SessionState::ApplyFact(const failure_t& fact) {
  const auto submap = submaps_.find(fact.submap_id);
  if (submap != submaps_.end() && !fact.step.empty()) {
    submap->second.failed_steps[fact.step] = {fact.attempts, fact.parked != 0, fact.reason};
  }
  if (fact.image_id == 0 || !fact.parked) return;
  ChangePhoto(fact.image_id, [&](PhotoState* photo) {
    photo->failed_stage = fact.stage;
    photo->failed_reason = fact.reason;
  });
}

void SessionState::ApplyFact(const finish_t& fact) {
  switch (fact.state) {
    case finish_t::REQUESTED:
      finish_ = {};
      finish_.finish_id = fact.finish_id;
      finish_.command = fact.detail;
      finish_.requested_utime_us = fact.header.utime_us;
      finish_.deadline_utime_us = fact.deadline_utime_us;
      break;
    case finish_t::DEADLINE:
      finish_.deadline_utime_us = fact.deadline_utime_us;
      return;
    case finish_t::CUT:
      finish_.cut_seq = fact.header.seq;
      finish_.cut_utime_us = fact.header.utime_us;
      finish_.cut_at = finish_.state;
      return;
    case finish_t::DRAINED:
      finish_.finish_id = fact.finish_id;
      finish_.drained_seq = last_drained_seq_ = fact.header.seq;
      break;
    case finish_t::BATCH:
      finish_.batch_seq = fact.header.seq;
      return;
    case finish_t::SETTLED:
      finish_.settled_seq = fact.header.seq;
      break;
    default:
      break;
  }
  finish_.state = fact.state;
}

}  // namespace skein
