// For tests: a ledger that is written fact by fact, its state, and the tally that follows it.
#pragma once

#include <algorithm>
#include <iterator>
#include <string>
#include <vector>

#include "session/session_history.h"
#include "session/session_tally.h"

namespace skein {

class TestLedger {
 public:
  const SessionState& state() const { return session_.state; }
  const SessionRecord& session() const { return session_; }
  const SessionTally& tally() const { return tally_; }
  int64_t head() const { return state().head(); }

  // The next fact; returns its seq. An order's merge_id is its seq.
  template <class T>
  int64_t Commit(T fact) {
    fact.header.seq = head() + 1;
    fact.header.utime_us = fact.header.seq * 1000000;
    if (fact.header.fact_id.empty()) fact.header.fact_id = std::to_string(fact.header.seq);
    SetMergeId(&fact);
    session_.Apply(Fact(fact));
    tally_.Apply(Fact(fact), state());
    return head();
  }

  int64_t Photo(int64_t image_id) {
    image_t image{};
    image.image_id = image_id;
    return Commit(image);
  }
  // AGENT/ID.jpg
  int64_t PhotoOf(const std::string& agent, int64_t image_id) {
    image_t image{};
    image.image_id = image_id;
    image.agent = agent;
    image.name = std::to_string(image_id) + ".jpg";
    return Commit(image);
  }
  // Matches of a photo, which is accepted before if it was not.
  int64_t Matches(int64_t image_id, const std::vector<two_view_t>& pairs) {
    if (state().FindPhoto(image_id) == nullptr) Photo(image_id);
    matches_t matches{};
    matches.image_id = image_id;
    matches.pairs = pairs;
    matches.num_pairs = static_cast<int32_t>(pairs.size());
    return Commit(matches);
  }
  static two_view_t Pair(int64_t other_id, int num_inliers = 100, float tri_angle_rad = 0,
                         float forward_motion = 0) {
    two_view_t pair{};
    pair.other_id = other_id;
    pair.num_inliers = num_inliers;
    pair.tri_angle_rad = tri_angle_rad;
    pair.forward_motion = forward_motion;
    return pair;
  }

  // Features, of a sharp photo full of details where nothing else is said, and candidates.
  void Describe(int64_t image_id, int num_candidates, features_t features = SharpPhoto()) {
    if (state().FindPhoto(image_id) == nullptr) Photo(image_id);
    features.image_id = image_id;
    Commit(features);
    candidates_t candidates{};
    candidates.image_id = image_id;
    candidates.num_candidates = num_candidates;
    candidates.other_ids.resize(num_candidates);
    candidates.distances.resize(num_candidates);
    Commit(candidates);
  }
  static features_t SharpPhoto() {
    features_t features{};
    features.num_keypoints = 5000;
    features.blur = 0.2F;
    features.brightness = 0.5F;
    features.coverage = 1;
    std::fill(std::begin(features.texture), std::end(features.texture), uint8_t{0xff});
    return features;
  }

  int64_t Seed(int64_t submap_id, int64_t image_id1, int64_t image_id2) {
    seed_t seed{};
    seed.submap_id = submap_id;
    seed.image_id1 = image_id1;
    seed.image_id2 = image_id2;
    return Commit(seed);
  }
  int64_t Lease(int64_t submap_id, int64_t epoch, const std::string& owner = "mapper-1") {
    submap_lease_t lease{};
    lease.submap_id = submap_id;
    lease.epoch = epoch;
    lease.owner = owner;
    return Commit(lease);
  }
  int64_t Register(int64_t submap_id, int64_t image_id, int8_t state = registration_t::REGISTERED,
                   int64_t epoch = 1) {
    registration_t registration{};
    registration.image_id = image_id;
    registration.submap_id = submap_id;
    registration.epoch = epoch;
    registration.state = state;
    return Commit(registration);
  }
  int64_t Model(int64_t submap_id, int8_t kind, int64_t ledger_seq = 0, int num_images = 0) {
    submap_model_t model{};
    model.submap_id = submap_id;
    model.kind = kind;
    model.ledger_seq = ledger_seq;
    model.num_images = num_images;
    return Commit(model);
  }
  int64_t End(int64_t submap_id, const std::string& reason = "initial pair") {
    submap_end_t end{};
    end.submap_id = submap_id;
    end.reason = reason;
    return Commit(end);
  }

  // Returns the merge's id.
  int64_t Order(int64_t source_id, int64_t target_id, int num_shared_images = 3) {
    return Merge(merge_t::ORDERED, 0, source_id, target_id, num_shared_images);
  }
  int64_t MergeStep(int64_t merge_id, int8_t state) {
    const merge_t& ordered = this->state().FindMerge(merge_id)->ordered();
    return Merge(state, merge_id, ordered.source_id, ordered.target_id, ordered.num_shared_images);
  }
  int64_t FailMerge(int64_t source_id, int64_t target_id, int num_shared_images) {
    return Merge(merge_t::FAILED, 0, source_id, target_id, num_shared_images);
  }
  int64_t Finish(int8_t state, int64_t deadline_utime_us = 0) {
    finish_t finish{};
    finish.finish_id = 1;
    finish.state = state;
    finish.deadline_utime_us = deadline_utime_us;
    return Commit(finish);
  }

 private:
  template <class T>
  static void SetMergeId(T*) {}
  static void SetMergeId(merge_t* merge) {
    if (merge->state == merge_t::ORDERED) merge->merge_id = merge->header.seq;
  }
  int64_t Merge(int8_t state, int64_t merge_id, int64_t source_id, int64_t target_id,
                int num_shared_images) {
    merge_t merge{};
    merge.state = state;
    merge.merge_id = merge_id;
    merge.source_id = source_id;
    merge.target_id = target_id;
    merge.num_shared_images = num_shared_images;
    merge.reason = state == merge_t::UNDONE ? "they disagree" : "";
    return Commit(merge);
  }

  SessionRecord session_;
  SessionTally tally_;
};

}  // namespace skein
