#pragma once

// Takes work of kind "matching", matches each photo with its candidates by second_look.h, submits
// matches_t.

#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "event_loop/worker_thread.h"
#include "matching/feature_loader.h"
#include "matching/matching_options.h"
#include "matching/photo_index.h"
#include "matching/photo_matcher.h"
#include "matching/second_look.h"
#include "node/ledger_follower.h"
#include "node/node.h"
#include "node/work_client.h"

namespace skein {

// Holds two items: one is matched on a worker thread (and matcher.num_threads - 1 more), the
// features of the other are fetched. The result depends on the photo's candidates and the ledger up
// to computed_at_seq. That grows with every batch, so pairs verified by other workers count at
// once. Loop's thread only.
class MatchingService {
 public:
  MatchingService(Node& node, const MatchingServiceOptions& options);

 private:
  // An item of work, from work_t until its result is committed.
  struct Job {
    std::optional<SecondLook> look;  // once the candidates are known
    PhotoFeaturesPtr photo;
    std::vector<int64_t> batch;            // the pairs that are matched now
    std::vector<PhotoFeaturesPtr> others;  // of the batch, null until loaded or if damaged
    size_t num_missing = 0;                // of the batch
    PhotoMatches matches;                  // of the batches before
  };

  void OnFact(const Fact& fact);
  void OnWork(const work_t& work);
  void StartIfKnown(int64_t image_id);
  void LoadPhoto(int64_t image_id);
  void OnPhotoLoaded(int64_t image_id, const Result<PhotoFeaturesPtr>& features);
  void StartNext();
  void LoadBatch();
  void LoadOther(size_t index);
  void Prefetch();
  void MatchBatch();
  void OnBatchMatched(PhotoMatches matches);
  void Submit();
  void SubmitFact(int64_t image_id, matches_t fact);
  // By value: the reason may belong to the job that ends here.
  void Fail(int64_t image_id, std::string reason, bool permanent);
  void FillHeartbeat(heartbeat_t* heartbeat) const;

  Node& node_;
  const SecondLookOptions second_look_;
  SessionState session_;
  PhotoIndex index_{session_};
  std::map<int64_t, Job> jobs_;
  std::deque<int64_t> waiting_;    // jobs whose photo is loaded
  std::optional<int64_t> active_;  // the job that is matched
  int64_t num_done_ = 0;
  double sum_elapsed_s_ = 0;

  PhotoMatcher matcher_;  // used by worker_ only
  FeatureLoader loader_;
  WorkerThread worker_;
  WorkClient work_;
  LedgerFollower follower_;
};

}  // namespace skein
