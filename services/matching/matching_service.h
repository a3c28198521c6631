#pragma once

// Takes work of kind "matching", matches each photo with its candidates by second_look.h, submits
// matches_t.

#include <deque>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/clock.h"
#include "event_loop/worker_thread.h"
#include "matching/coarse_search.h"
#include "matching/feature_loader.h"
#include "matching/matching_options.h"
#include "matching/photo_index.h"
#include "matching/photo_matches.h"
#include "matching/second_look.h"
#include "node/ledger_follower.h"
#include "node/node.h"
#include "node/work_client.h"

namespace skein {

// Holds two items: the pairs of one are matched on as many worker threads as the node may use, the
// features of the other are fetched. The result depends on the photo's candidates and the ledger up
// to computed_at_seq. The ledger grows with every pair, so pairs verified by other workers count at
// once.
//
// A pair whose matching throws is left out. If all pairs of a photo threw, and there were at least
// two, the photo fails: it is what these pairs share. Loop's thread only.
class MatchingService {
 public:
  MatchingService(Node& node, const MatchingServiceOptions& options);

  // For tests: called on the worker's thread before a pair is matched, or compared (`other_id`). An
  // exception of `observer` is one of the matching.
  void OnPair(std::function<void(int64_t image_id, int64_t other_id)> observer) {
    on_pair_ = std::move(observer);
  }

 private:
  // An item of work, from work_t until its result is committed.
  struct Job {
    std::optional<SecondLook> look;  // once the candidates are known
    PhotoFeaturesPtr photo;
    PhotoMatches matches;                // so far
    std::optional<CoarseSearch> search;  // once the candidates that `look` takes are matched
    Timer since_begun;                   // from when it is the active one
    int num_thrown = 0;                  // pairs that threw
    std::string thrown;                  // by the latest
  };

  // A pair of the active job, taken and loaded, for the next free worker.
  struct ReadyPair {
    int64_t other_id = 0;
    PhotoFeaturesPtr other;  // null if it is damaged
  };

  struct Worker {
    Worker(PollLoop& loop, bool cascade, KernelVersion kernel)
        : matcher(cascade, kernel), thread(loop) {}

    PairMatcher matcher;  // used by `thread` only
    WorkerThread thread;
  };

  void OnFact(const Fact& fact);
  void OnWork(const work_t& work);
  void StartIfKnown(int64_t image_id);
  void LoadPhoto(int64_t image_id);
  void OnPhotoLoaded(int64_t image_id, const Result<PhotoFeaturesPtr>& features);
  void StartNext();
  void TakePairs();
  void LoadOther(int64_t other_id);
  // The search for further photos, a group at a time.
  void LookAtSome();
  void CountMatches(std::vector<PhotoFeaturesPtr> others);
  void Prefetch();
  void MatchReadyPairs();
  // On a worker's thread. `other`: null if it is damaged (kDataLoss).
  Result<PairResult> TryToMatch(PairMatcher* matcher, const PhotoFeatures& photo,
                                const PhotoFeaturesPtr& other) const;
  // 0 if it throws. On a worker's thread.
  int TryToCount(PairMatcher* matcher, const PhotoFeatures& photo,
                 const PhotoFeatures& other) const;
  void OnPairMatched(int64_t other_id, const Result<PairResult>& result);
  void NoteThrown(int64_t other_id, const std::string& reason, Job* job);
  bool IsToBlame(int64_t image_id) const;
  void FailActive();
  void Submit();
  matches_t MakeFact(int64_t image_id, int64_t seq, const PhotoMatches& matches) const;
  void OnFactMade(int64_t image_id, Result<matches_t> fact);
  void SubmitFact(int64_t image_id, matches_t fact);
  // By value: the reason may belong to the job that ends here.
  void Fail(int64_t image_id, std::string reason, bool permanent);
  void FillHeartbeat(heartbeat_t* heartbeat) const;

  Node& node_;
  const bool second_look_;
  SessionState session_;
  PhotoIndex index_{session_};
  std::map<int64_t, Job> jobs_;
  std::deque<int64_t> waiting_;    // jobs whose photo is loaded
  std::optional<int64_t> active_;  // the job that is matched
  std::deque<ReadyPair> ready_;
  int64_t num_done_ = 0;
  double sum_elapsed_s_ = 0;
  std::function<void(int64_t image_id, int64_t other_id)> on_pair_;  // used by the workers

  FeatureLoader loader_;
  std::deque<Worker> workers_;
  WorkClient work_;
  LedgerFollower follower_;
};

}  // namespace skein
