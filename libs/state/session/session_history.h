#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <tuple>
#include <unordered_map>
#include <utility>
#include <vector>

#include "ledger/facts.h"
#include "session/session_state.h"

namespace skein {

// Sums over the photos through matching.
struct RetrievalCounts {
  int64_t candidates = 0;      // named by retrieval
  int64_t hits = 0;            // of these, verified by matching
  int64_t pairs_matched = 0;   // also others than candidates
  int64_t pairs_verified = 0;  // of these
};

// Times in seconds of what a stage did, in the order of commit. "STAGE.STEP" is a part of STAGE.
struct StageTimes {
  std::map<std::string, std::vector<float>> by_stage;
  std::map<std::string, double> sum_s;  // of by_stage; times that are not above 0 count as 0
};

// Stages of each photo, in this order. Each stage ends when ingest commits its fact.
enum class PhotoStage { kIngest, kFeatures, kRetrieval, kMatching, kMapper };
constexpr std::array<const char*, 5> kPhotoStages = {"ingest", "features", "retrieval", "matching",
                                                     "mapper"};

// When one photo was through each stage, and for how long somebody worked at it there.
struct PhotoPath {
  int64_t received_utime_us = 0;
  std::array<int64_t, kPhotoStages.size()>
      end_utime_us{};                               // 0: not yet. Mapper: first registration
  std::array<float, kPhotoStages.size()> work_s{};  // 0: not known
};

// Configuration of a service's instances: those with one text and version together.
struct Configuration {
  std::string service;
  std::string text;  // its section of a config file
  std::string version;
  bool operator<(const Configuration& other) const {
    return std::tie(service, text, version) < std::tie(other.service, other.text, other.version);
  }
};

// Queries of the ledger that only ingest and the status need: which facts and contents there are,
// what failed, how long everything took. Grows with the number of facts.
class SessionHistory {
 public:
  struct FirstRegistration {
    int64_t utime_us = 0;  // of its commit
    int64_t submap_id = 0;
  };

  // Facts in the order of seq.
  void Apply(const Fact& fact);

  // seq of the fact with that id, 0 if there is none.
  int64_t FindFact(const std::string& fact_id) const;
  int64_t FindImageByBlob(const std::string& blob_id) const;  // 0 if none
  // By photo.
  const std::unordered_map<int64_t, PhotoPath>& paths() const { return paths_; }
  // Null if it was never registered.
  const FirstRegistration* FindFirstRegistration(int64_t image_id) const;

  // Offers that were refused and photos or work that failed for good, in the order of commit; by
  // the id of the fact.
  std::vector<failure_t> Failures() const;
  const std::map<int64_t, failure_t>& all_failures() const { return failures_; }  // by seq
  const failure_t* FindFailure(const std::string& fact_id) const;
  // Failures() of photos that ingest refused or that were lost with their agent.
  int64_t num_refused() const { return num_refused_; }

  // Command id -> finish id, and finish id -> what was told of one that is DONE.
  const std::map<int64_t, int64_t>& finish_of_command() const { return finish_of_command_; }
  const std::map<int64_t, std::string>& finish_results() const { return finish_results_; }

  // How often a submap registered a photo by itself, each photo once a submap: 1 a photo at best.
  int64_t num_placements() const { return static_cast<int64_t>(placements_.size()); }
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
  void ApplyFact(const merge_t& fact);
  void ApplyFact(const failure_t& fact);
  void ApplyFact(const finish_t& fact);
  void ApplyFact(const configuration_t& fact);
  template <class T>
  void ApplyFact(const T&) {}
  void CountHits(const matches_t& fact);
  void ForgetVanished(const std::string& blob_id);
  void EndStage(int64_t image_id, PhotoStage stage, int64_t utime_us, float work_s);
  void AddTime(const std::string& stage, float seconds);

  std::unordered_map<std::string, int64_t> fact_ids_;
  std::unordered_map<std::string, int64_t> image_by_blob_;
  std::unordered_map<int64_t, FirstRegistration> first_registrations_;  // by photo
  std::unordered_map<int64_t, PhotoPath> paths_;
  std::set<std::pair<int64_t, int64_t>> placements_;  // photo, submap
  std::map<int64_t, failure_t> failures_;             // by seq
  std::unordered_map<std::string, int64_t> failure_by_id_;
  int64_t num_refused_ = 0;
  // Fact ids of vanished agents, by the content that they were sending.
  std::unordered_map<std::string, std::vector<std::string>> vanished_;
  std::map<int64_t, int64_t> finish_of_command_;
  std::map<int64_t, std::string> finish_results_;
  StageTimes times_;
  std::unordered_map<int64_t, std::vector<int64_t>> unmatched_candidates_;  // by photo
  RetrievalCounts retrieval_;
  std::map<Configuration, std::set<std::string>> configurations_;
};

// All that is to be known of a session.
struct SessionRecord {
  SessionState state;
  SessionHistory history;

  void Apply(const Fact& fact) {
    state.Apply(fact);
    history.Apply(fact);
  }
};

}  // namespace skein
