#pragma once

// Takes work of kind "features": photo in, local features and global descriptor out, features_t.

#include <map>
#include <memory>
#include <string>
#include <unordered_set>

#include "event_loop/worker_thread.h"
#include "features/describe_photo.h"
#include "features/messages.h"
#include "node/ledger_follower.h"
#include "node/node.h"
#include "node/work_client.h"

namespace skein {

// Holds three items: one is computed on a worker thread, the photo of one is fetched, the result of
// one is being committed. A photo is computed on as many threads as cores are idle, at most
// `max_threads`. Loop's thread only.
class FeaturesService {
 public:
  FeaturesService(Node& node, const SiftOptions& sift, int max_threads,
                  std::shared_ptr<GlobalDescriptorModel> model,
                  std::unique_ptr<PhotoDecoder> decoder);

 private:
  // An item of work, from work_t until its result is committed.
  struct Job {
    int64_t computed_at_seq = 0;
    bool started = false;
  };
  struct Described {
    PhotoDescription photo;
    ResultBlobs blobs;
    double elapsed_s = 0;
  };

  void OnFact(const Fact& fact);
  void OnWork(const work_t& work);
  void StartIfKnown(int64_t image_id);
  void Compute(const image_t& image, Bytes photo);
  void OnDescribed(int64_t image_id, const Result<Described>& described);
  Result<Described> Describe(const image_t& image, const Bytes& photo);
  void Submit(int64_t image_id, const Described& described);
  void Fail(int64_t image_id, const std::string& reason, bool permanent);
  void FillHeartbeat(heartbeat_t* heartbeat) const;

  Node& node_;
  const int max_threads_;
  SiftExtractor sift_;                                  // used by worker_ only
  const std::shared_ptr<GlobalDescriptorModel> model_;  // id and dim aside, used by worker_ only
  const std::unique_ptr<PhotoDecoder> decoder_;         // used by worker_ only
  std::map<int64_t, image_t> images_;                   // photos without features
  std::unordered_set<int64_t> described_;               // photos with features
  std::map<int64_t, Job> jobs_;
  int64_t num_done_ = 0;
  double sum_elapsed_s_ = 0;

  WorkerThread worker_;
  WorkClient work_;
  LedgerFollower follower_;
};

}  // namespace skein
