#include "session/session_tally.h"

#include <algorithm>

namespace skein {

PhotoPhase PhaseOf(const SessionState& state, int64_t image_id, const PhotoState& photo) {
  if (state.IsRegistered(image_id)) return PhotoPhase::kRegistered;
  if (photo.failed()) return PhotoPhase::kFailed;
  if (photo.features_seq == 0) return PhotoPhase::kFeatures;
  if (photo.candidates_seq == 0) return PhotoPhase::kRetrieval;
  if (photo.matches_seq == 0) return PhotoPhase::kMatching;
  const bool waits = !photo.pairs_blob.empty() && state.FindTrial(image_id) == nullptr;
  return waits ? PhotoPhase::kMapper : PhotoPhase::kUnplaced;
}

void SessionTally::Apply(const Fact& fact, const SessionState& state) {
  std::visit([&](const auto& f) { ApplyFact(f, state); }, fact);
}

std::optional<int64_t> SessionTally::OldestUtimeUs(PhotoPhase phase) const {
  const auto& waiting = waiting_.at(static_cast<size_t>(phase));
  return waiting.empty() ? std::nullopt : std::optional<int64_t>(waiting.begin()->first);
}

void SessionTally::Look(int64_t image_id, const SessionState& state) {
  const PhotoState* photo = state.FindPhoto(image_id);
  if (photo == nullptr) return;
  const PhotoPhase phase = PhaseOf(state, image_id, *photo);
  const auto [entry, is_new] = photos_.try_emplace(image_id);
  Photo& known = entry->second;
  if (!is_new) {
    if (known.phase == phase) return;
    const auto before = static_cast<size_t>(known.phase);
    --counts_[before];
    if (before < waiting_.size()) waiting_[before].erase({known.since_utime_us, image_id});
  }
  known.phase = phase;
  known.since_utime_us = state.last_utime_us();
  const auto now = static_cast<size_t>(phase);
  ++counts_[now];
  if (now < waiting_.size()) waiting_[now].insert({known.since_utime_us, image_id});
}

void SessionTally::LookAtPhotosOf(int64_t submap_id, const SessionState& state) {
  const SubmapLife* submap = state.FindSubmap(submap_id);
  if (submap == nullptr) return;
  for (const auto& [image_id, photo] : submap->photos) Look(image_id, state);
}

void SessionTally::ApplyFact(const image_t& fact, const SessionState& state) {
  if (photos_.count(fact.image_id) == 0) photo_bytes_ += std::max<int64_t>(fact.size_bytes, 0);
  Look(fact.image_id, state);
}

void SessionTally::ApplyFact(const features_t& fact, const SessionState& state) {
  Look(fact.image_id, state);
}

void SessionTally::ApplyFact(const candidates_t& fact, const SessionState& state) {
  Look(fact.image_id, state);
}

void SessionTally::ApplyFact(const matches_t& fact, const SessionState& state) {
  Look(fact.image_id, state);
}

void SessionTally::ApplyFact(const failure_t& fact, const SessionState& state) {
  Look(fact.image_id, state);
}

void SessionTally::ApplyFact(const registration_t& fact, const SessionState& state) {
  Look(fact.image_id, state);
  const auto photo = photos_.find(fact.image_id);
  if (photo == photos_.end() || fact.state != registration_t::REGISTERED) return;
  if (std::exchange(photo->second.was_registered, true)) return;
  const int64_t received_utime_us = state.FindPhoto(fact.image_id)->image.received_utime_us;
  CountLatency(static_cast<double>(fact.header.utime_us - received_utime_us) * 1e-6);
}

// A clock that was set back counts as 0 seconds: sums of a histogram never fall.
void SessionTally::CountLatency(double seconds) {
  const auto bound = std::lower_bound(kLatencyBoundsS.begin(), kLatencyBoundsS.end(), seconds);
  ++latency_.photos[static_cast<size_t>(bound - kLatencyBoundsS.begin())];
  latency_.sum_s += std::max(seconds, 0.0);
}

void SessionTally::ApplyFact(const submap_end_t& fact, const SessionState& state) {
  LookAtPhotosOf(fact.submap_id, state);
}

// The source ends with DONE.
void SessionTally::ApplyFact(const merge_t& fact, const SessionState& state) {
  if (fact.state == merge_t::DONE) LookAtPhotosOf(fact.source_id, state);
}

}  // namespace skein
