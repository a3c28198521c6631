#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <tuple>
#include <unordered_map>
#include <vector>

#include "ledger/facts.h"

namespace skein {

// What the facts say of one photo.
struct PhotoState {
  struct InSubmap {
    int8_t state = 0;  // registration_t's
    std::string reason;
  };

  image_t image;
  int64_t features_seq = 0;    // 0: not yet
  int64_t candidates_seq = 0;  // 0: not yet
  int64_t matches_seq = 0;     // 0: not yet
  int32_t num_keypoints = 0;
  int32_t num_pairs = 0;
  std::string failed_stage;  // parked at this stage, "" if not
  std::string failed_reason;
  int64_t registered_utime_us = 0;        // commit of its first REGISTERED, 0 if none
  int64_t registered_submap_id = 0;       // of that
  std::map<int64_t, InSubmap> in_submap;  // submap id -> latest

  bool failed() const { return !failed_stage.empty(); }
  bool through_matching() const { return matches_seq > 0 || failed(); }
};

struct SubmapState {
  seed_t seed;
  int64_t epoch = 0;  // 0: never leased
  std::string owner;
  bool ended = false;
  std::string end_reason;
  submap_t model;                 // latest fact that came with a model; seq 0 if none
  int64_t final_ledger_seq = -1;  // position of the latest FINAL, -1 if none
  int64_t open_merge_id = 0;      // ordered and neither done nor undone, 0 if none
};

struct MergeState {
  merge_t ordered;
  merge_t latest;
};

struct FinishState {
  int64_t finish_id = 0;  // 0: never asked for
  int8_t state = finish_t::DONE;
  std::string command;  // the command that asked
  int64_t requested_utime_us = 0;
  int64_t drained_seq = 0;
  int64_t settled_seq = 0;
};

// Sums over the photos through matching.
struct RetrievalCounts {
  int64_t candidates = 0;      // named by retrieval
  int64_t hits = 0;            // of these, verified by matching
  int64_t pairs_matched = 0;   // also others than candidates
  int64_t pairs_verified = 0;  // of these
};

// What a service ran with: instances with one text and version together.
struct Configuration {
  std::string service;
  std::string text;  // its section of a config file
  std::string version;
  bool operator<(const Configuration& other) const {
    return std::tie(service, text, version) < std::tie(other.service, other.text, other.version);
  }
};

// Times in seconds of what a stage did, in the order of commit.
struct StageTimes {
  std::map<std::string, std::vector<float>> by_stage;
};

// Everything that follows from the facts so far: a pure function of the ledger. Replaying a ledger
// gives the same state as having lived through it.
class SessionState {
 public:
  // Facts in the order of seq, without gaps; throws std::logic_error otherwise.
  void Apply(const Fact& fact);

  int64_t head() const { return head_seq_; }
  int64_t last_utime_us() const { return last_utime_us_; }
  // seq of the fact with that id, 0 if there is none.
  int64_t FindFact(const std::string& fact_id) const;

  const std::map<int64_t, PhotoState>& photos() const { return photos_; }
  const PhotoState* FindPhoto(int64_t image_id) const;
  int64_t FindImageByBlob(const std::string& blob_id) const;                         // 0 if none
  int64_t FindImageByName(const std::string& agent, const std::string& name) const;  // 0 if none
  int64_t num_images() const { return static_cast<int64_t>(photos_.size()); }
  int64_t num_cameras() const { return num_cameras_; }
  // Photos accepted and not yet through matching.
  int64_t num_in_flight() const { return num_images() - num_through_; }
  // Registered in at least one submap that lives.
  bool IsRegistered(const PhotoState& photo) const;
  // Why it is not registered, for a person.
  std::string WhyUnregistered(const PhotoState& photo) const;

  const std::map<int64_t, SubmapState>& submaps() const { return submaps_; }
  const SubmapState* FindSubmap(int64_t submap_id) const;
  bool IsLive(int64_t submap_id) const;
  const std::map<int64_t, MergeState>& merges() const { return merges_; }
  const FinishState& finish() const { return finish_; }
  bool finishing() const { return finish_.state != finish_t::DONE; }

  // Offers that were refused and photos or work that failed for good, in the order of commit; by
  // the id of the fact.
  std::vector<failure_t> Failures() const;
  const failure_t* FindFailure(const std::string& fact_id) const;

  const StageTimes& times() const { return times_; }
  const RetrievalCounts& retrieval() const { return retrieval_; }
  // With the instances that ran so.
  const std::map<Configuration, std::set<std::string>>& configurations() const {
    return configurations_;
  }

 private:
  void ApplyFact(const image_t& fact);
  void ApplyFact(const features_t& fact);
  void ApplyFact(const candidates_t& fact);
  void ApplyFact(const matches_t& fact);
  void ApplyFact(const registration_t& fact);
  void ApplyFact(const submap_t& fact);
  void ApplyFact(const seed_t& fact);
  void ApplyFact(const merge_t& fact);
  void ApplyFact(const failure_t& fact);
  void ApplyFact(const finish_t& fact);
  void ApplyFact(const configuration_t& fact);
  void CountHits(const matches_t& fact);
  PhotoState* Photo(int64_t image_id);
  template <class Change>
  void ChangePhoto(int64_t image_id, Change change);
  void AddTime(const std::string& stage, float seconds) {
    times_.by_stage[stage].push_back(seconds);
  }

  int64_t head_seq_ = 0;
  int64_t last_utime_us_ = 0;
  std::unordered_map<std::string, int64_t> fact_ids_;
  std::map<int64_t, PhotoState> photos_;
  std::unordered_map<std::string, int64_t> image_by_blob_;
  std::map<std::pair<std::string, std::string>, int64_t> image_by_name_;
  int64_t num_cameras_ = 0;
  int64_t num_through_ = 0;
  std::map<int64_t, SubmapState> submaps_;
  std::map<int64_t, MergeState> merges_;
  std::map<int64_t, failure_t> failures_;  // by seq
  std::unordered_map<std::string, int64_t> failure_by_id_;
  FinishState finish_;
  StageTimes times_;
  std::unordered_map<int64_t, std::vector<int64_t>> unmatched_candidates_;  // by photo
  RetrievalCounts retrieval_;
  std::map<Configuration, std::set<std::string>> configurations_;
};

// fact_id of the failure of an offer: one refusal per agent, name and content.
std::string RefusalId(const std::string& agent, const std::string& name,
                      const std::string& blob_id);
// fact_id of the failure of an agent that vanished while its photo was pulled.
std::string VanishedId(const std::string& blob_id, int64_t finish_id);

}  // namespace skein
