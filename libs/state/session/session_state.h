#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "covisibility/covisibility.h"
#include "formats/texture_fields.h"
#include "ledger/facts.h"

namespace skein {

// AGENT/NAME, or NAME where there is no agent.
std::string PhotoName(const std::string& agent, const std::string& name);

// State of one photo, as the facts tell it.
struct PhotoState {
  image_t image{};
  features_t features;         // once features_seq > 0
  candidates_t candidates;     // once candidates_seq > 0
  std::string pairs_blob;      // of its matches; "" if it has none. The pairs: covisibility()
  int64_t features_seq = 0;    // 0: not yet
  int64_t candidates_seq = 0;  // 0: not yet
  int64_t matches_seq = 0;     // 0: not yet
  int64_t matches_order = 0;   // from 1, among the photos with matches; 0: not yet
  std::string failed_stage;    // parked at this stage, "" if not
  std::string failed_reason;

  bool failed() const { return !failed_stage.empty(); }
  bool through_matching() const { return matches_seq > 0 || failed(); }
};

// Texture of the photo, by field of a grid; nullopt if not known yet.
std::optional<TextureFields> TextureOf(const PhotoState& photo);

// A submap's life: seed, leases, models, end. `latest_model` is the newest checkpoint or final
// model; `final_ledger_seq` is the position of the newest final one. A lease changes neither. So a
// submap with a new lease after its FINAL stays final until it has a newer checkpoint.
struct SubmapLife {
  // The latest word on a photo.
  struct Photo {
    int8_t state = 0;  // registration_t's
    int8_t cause = 0;  // registration_t's
    int32_t num_inliers = 0;
    std::string reason;
  };

  // A step of its mapper's work that threw, crashed or hung (submap_steps.h).
  struct FailedStep {
    int32_t attempts = 0;
    bool left_out = false;  // not tried again
    std::string reason;
  };

  seed_t seed;
  bool has_seed = false;
  submap_lease_t lease;  // the latest; epoch 0: never leased
  std::optional<submap_model_t> latest_model;
  int64_t final_ledger_seq = -1;  // -1: none
  int64_t open_merge_id = 0;  // ordered, neither done nor undone, and both submaps live; 0: none
  bool ended = false;
  std::string end_reason;
  int64_t merged_into = 0;  // 0: not merged
  std::map<int64_t, Photo> photos;
  int64_t num_registered = 0;
  std::map<std::string, FailedStep> failed_steps;  // by name

  bool IsRegistered(int64_t image_id) const;
  bool IsLeftOut(const std::string& step) const;
};

// The facts of a merge that was ordered, in order, from ORDERED on.
struct MergeState {
  std::vector<merge_t> facts;
  bool abandoned = false;  // a submap of the merge ended before DONE or UNDONE

  const merge_t& ordered() const { return facts.front(); }
  const merge_t& latest() const { return facts.back(); }
  bool is_open() const {
    return !abandoned && (latest().state == merge_t::ORDERED || latest().state == merge_t::FROZEN);
  }
};

struct FinishState {
  int64_t finish_id = 0;  // 0: never asked for
  int8_t state = finish_t::DONE;
  std::string command;  // the command that asked
  int64_t requested_utime_us = 0;
  int64_t deadline_utime_us = 0;  // by ingest's clock; 0: none
  int64_t drained_seq = 0;
  int64_t batch_seq = 0;  // 0: no place was divided so far
  int64_t settled_seq = 0;
  int64_t cut_seq = 0;  // 0: not cut
  int8_t cut_at = 0;    // the state in which it was cut
  int64_t cut_utime_us = 0;

  // The deadline has passed, and the results are not written yet.
  bool is_cut() const { return cut_seq > 0 && state != finish_t::DONE; }
};

// State of a session: a pure function of the ledger, folded here and nowhere else. Replaying a
// ledger gives the same state as having lived through it. Cost per fact is independent of the
// ledger's length; memory is about 2 KB and 40 bytes a verified pair for each photo.
//
// Merges. ORDERED opens a merge; DONE and UNDONE close it, and so does the end of either submap.
// FAILED is an attempt that found no similarity: nothing was ordered, it has no merge_id, and it
// stands in failed_merges() alone. DONE ends the source, which is `merged_into` the target; the
// source's end fact follows in the same commit. DONE moves no photo. The target has submitted a
// registration before it for each photo that came with the source. The target holds no other photo
// of the source.
class SessionState {
 public:
  // Facts in the order of seq, without gaps. Throws BrokenState (core/attempt.h) otherwise, and for
  // any exception on the way: the state would hold half a fact.
  void Apply(const Fact& fact);

  int64_t head() const { return head_seq_; }
  int64_t last_utime_us() const { return last_utime_us_; }

  const std::map<int64_t, PhotoState>& photos() const { return photos_; }
  const PhotoState* FindPhoto(int64_t image_id) const;  // null if unknown
  std::string NameOf(int64_t image_id) const;           // PhotoName; its id if unknown
  int64_t num_images() const { return static_cast<int64_t>(photos_.size()); }
  // A ledger that was repaired may lack ids in between.
  int64_t next_image_id() const { return photos_.empty() ? 1 : photos_.rbegin()->first + 1; }
  int64_t num_cameras() const { return num_cameras_; }
  int64_t num_matched() const { return num_matched_; }  // photos with matches
  // Photos accepted and not yet through matching.
  int64_t num_in_flight() const { return num_images() - num_through_; }
  // Verified pairs with the seq at which they became known: what works at a cursor leaves out the
  // edges beyond it.
  const CovisibilityGraph& covisibility() const { return covisibility_; }
  // Registered in at least one submap that lives.
  bool IsRegistered(int64_t image_id) const;
  // State of the photo in the youngest living submap that tried it; null if none tried.
  const SubmapLife::Photo* FindTrial(int64_t image_id) const;

  const std::map<int64_t, SubmapLife>& submaps() const { return submaps_; }
  const SubmapLife* FindSubmap(int64_t submap_id) const;  // null if unknown
  bool IsLive(int64_t submap_id) const;
  // Whether any submap, living or ended, was seeded with the two photos.
  bool WasSeeded(int64_t image_id1, int64_t image_id2) const;
  // In the initial pair of a submap that has not ended, if it was withdrawn from it, too. Costs the
  // submaps.
  bool IsInLiveSeed(int64_t image_id) const;
  // Photos that the submap holds, by id.
  std::vector<int64_t> RegisteredIn(int64_t submap_id) const;

  const std::map<int64_t, MergeState>& merges() const { return merges_; }
  const MergeState* FindMerge(int64_t merge_id) const;  // null if it was never ordered
  const std::vector<merge_t>& failed_merges() const { return failed_merges_; }

  const FinishState& finish() const { return finish_; }
  bool finishing() const { return finish_.state != finish_t::DONE; }
  // seq of the latest DRAINED, of this finish or an earlier one; 0 before the first.
  int64_t last_drained_seq() const { return last_drained_seq_; }

 private:
  void ApplyFact(const image_t& fact);
  void ApplyFact(const features_t& fact);
  void ApplyFact(const candidates_t& fact);
  void ApplyFact(const matches_t& fact);
  void ApplyFact(const seed_t& fact);
  void ApplyFact(const submap_lease_t& fact);
  void ApplyFact(const registration_t& fact);
  void ApplyFact(const submap_model_t& fact);
  void ApplyFact(const submap_end_t& fact);
  void ApplyFact(const merge_t& fact);
  void ApplyFact(const failure_t& fact);
  void ApplyFact(const finish_t& fact);
  void ApplyFact(const configuration_t&) {}
  void CloseMerge(int64_t merge_id);
  void EndSubmap(int64_t submap_id, const std::string& reason, int64_t merged_into);
  template <class Change>
  void ChangePhoto(int64_t image_id, Change change);

  int64_t head_seq_ = 0;
  int64_t last_utime_us_ = 0;
  std::map<int64_t, PhotoState> photos_;
  int64_t num_cameras_ = 0;
  int64_t num_matched_ = 0;
  int64_t num_through_ = 0;
  CovisibilityGraph covisibility_;
  std::map<int64_t, SubmapLife> submaps_;
  std::set<std::pair<int64_t, int64_t>> seeded_;  // images, smaller id first
  std::map<int64_t, MergeState> merges_;
  std::vector<merge_t> failed_merges_;
  FinishState finish_;
  int64_t last_drained_seq_ = 0;
};

// Why the source of a merge has ended, for a person.
std::string MergedReason(int64_t target_id);

}  // namespace skein
