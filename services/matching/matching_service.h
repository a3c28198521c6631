#pragma once

// Takes work of kind "matching", matches each photo with its candidates, submits matches_t.

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "matching/feature_loader.h"
#include "matching/photo_index.h"
#include "matching/photo_matcher.h"
#include "messaging/ledger_follower.h"
#include "messaging/node.h"
#include "messaging/work_client.h"
#include "messaging/worker_thread.h"

namespace skein {

struct MatchingServiceOptions {
  PhotoMatcherOptions matcher;
  size_t cache_bytes = size_t{512} << 20;  // features of recently used photos
};

// Loop's thread; the matching itself runs on a worker thread (and matcher.num_threads - 1 more).
// Holds two items: one that is matched, one whose features are fetched meanwhile.
class MatchingService {
 public:
  MatchingService(Node& node, const MatchingServiceOptions& options);

 private:
  // An item of work, from work_t until its result is committed.
  struct Job {
    int64_t computed_at_seq = 0;
    int num_missing = 0;
    PhotoFeaturesPtr photo;
    std::vector<PhotoFeaturesPtr> others;  // in the order of the candidates, null until loaded
    std::string error;                     // why the photo itself cannot be matched
    bool started = false;
  };
  struct Outcome {
    PhotoMatches matches;
    std::string pairs_blob;
  };

  void OnFact(const Fact& fact);
  void OnWork(const work_t& work);
  void StartIfKnown(int64_t image_id);
  void LoadPhoto(int64_t image_id);
  void LoadOther(int64_t image_id, size_t index, int64_t other_id);
  void OnOneLoaded(int64_t image_id);
  void Match(int64_t image_id);
  void Submit(int64_t image_id, const Outcome& outcome);
  // By value: the reason may belong to the job that ends here.
  void Fail(int64_t image_id, std::string reason, bool permanent);
  void FillHeartbeat(heartbeat_t* heartbeat) const;

  Node& node_;
  PhotoIndex index_;
  std::map<int64_t, Job> jobs_;
  int64_t num_done_ = 0;
  double sum_elapsed_s_ = 0;

  PhotoMatcher matcher_;  // used by worker_ only
  FeatureLoader loader_;
  WorkerThread worker_;
  WorkClient work_;
  LedgerFollower follower_;
};

}  // namespace skein
