#include "matching/matching_service.h"

#include <spdlog/spdlog.h>

#include <utility>

#include "matching/messages.h"

namespace skein {

MatchingService::MatchingService(Node& node, const MatchingServiceOptions& options)
    : node_(node),
      matcher_(options.matcher),
      loader_(node.loop(), node.blobs(), options.cache_bytes),
      worker_(node.loop()),
      work_(node, "matching", 2, [this](const work_t& work) { OnWork(work); }),
      follower_(node, 1, [this](const Fact& fact) { OnFact(fact); }) {
  node.OnHeartbeat([this](heartbeat_t* heartbeat) { FillHeartbeat(heartbeat); });
}

void MatchingService::OnFact(const Fact& fact) {
  const Status status = index_.Take(fact);
  if (!status.ok()) {
    spdlog::warn("fact {} by {}: {}", Header(fact).seq, Header(fact).author, status.error());
  }
  if (const auto* candidates = std::get_if<candidates_t>(&fact)) StartIfKnown(candidates->image_id);
}

void MatchingService::OnWork(const work_t& work) {
  jobs_.try_emplace(work.item_id);
  StartIfKnown(work.item_id);
}

// The ledger may be behind the work: candidates that come later start the job.
void MatchingService::StartIfKnown(int64_t image_id) {
  const auto job = jobs_.find(image_id);
  if (job == jobs_.end() || job->second.started || !index_.HasCandidates(image_id)) return;
  if (!index_.FindFeatures(image_id)) return Fail(image_id, "the photo has no features", true);
  const std::vector<int64_t> others = index_.CandidatesOf(image_id);
  job->second.started = true;
  job->second.computed_at_seq = follower_.processed_seq();
  job->second.others.resize(others.size());
  job->second.num_missing = 1 + static_cast<int>(others.size());
  LoadPhoto(image_id);
  for (size_t i = 0; i < others.size(); ++i) LoadOther(image_id, i, others[i]);
}

void MatchingService::LoadPhoto(int64_t image_id) {
  loader_.Load(image_id, *index_.FindFeatures(image_id),
               [this, image_id](const Result<PhotoFeaturesPtr>& features) {
                 Job& job = jobs_.at(image_id);
                 if (features.ok()) {
                   job.photo = *features;
                 } else {
                   job.error = features.error();
                 }
                 OnOneLoaded(image_id);
               });
}

void MatchingService::LoadOther(int64_t image_id, size_t index, int64_t other_id) {
  loader_.Load(other_id, *index_.FindFeatures(other_id),
               [this, image_id, index, other_id](const Result<PhotoFeaturesPtr>& features) {
                 if (features.ok()) {
                   jobs_.at(image_id).others[index] = *features;
                 } else {
                   spdlog::warn("image {} is not matched with {}: {}", image_id, other_id,
                                features.error());
                 }
                 OnOneLoaded(image_id);
               });
}

void MatchingService::OnOneLoaded(int64_t image_id) {
  Job& job = jobs_.at(image_id);
  if (--job.num_missing > 0) return;
  if (!job.photo) return Fail(image_id, job.error, false);
  Match(image_id);
}

void MatchingService::Match(int64_t image_id) {
  const Job& job = jobs_.at(image_id);
  std::vector<PhotoFeaturesPtr> others;
  for (const PhotoFeaturesPtr& other : job.others) {
    if (other) others.push_back(other);
  }
  worker_.Run(
      [this, photo = job.photo, others = std::move(others)] {
        Outcome outcome;
        outcome.matches = matcher_.Match(*photo, others);
        if (!outcome.matches.pairs.empty()) {
          outcome.pairs_blob = node_.blobs().Offer(EncodeTwoViewPairs(outcome.matches.pairs));
        }
        return outcome;
      },
      [this, image_id](const Outcome& outcome) { Submit(image_id, outcome); });
}

void MatchingService::Submit(int64_t image_id, const Outcome& outcome) {
  matches_t fact = ToMessage(image_id, outcome.matches, outcome.pairs_blob);
  fact.header.computed_at_seq = jobs_.at(image_id).computed_at_seq;
  ++num_done_;
  sum_elapsed_s_ += outcome.matches.elapsed_s;
  spdlog::debug("image {}: {} of {} pairs verified, match {:.2f} s, verify {:.2f} s", image_id,
                fact.num_pairs, fact.num_tried, fact.match_s, fact.verify_s);
  node_.submitter().Submit(std::move(fact),
                           [this, image_id](bool committed, int64_t, const std::string& reason) {
                             if (!committed) return Fail(image_id, reason, true);
                             jobs_.erase(image_id);
                             work_.Done(image_id);
                           });
}

void MatchingService::Fail(int64_t image_id, std::string reason, bool permanent) {
  spdlog::warn("image {}: {}", image_id, reason);
  jobs_.erase(image_id);
  work_.Fail(image_id, reason, permanent);
}

void MatchingService::FillHeartbeat(heartbeat_t* heartbeat) const {
  heartbeat->state = jobs_.empty() ? "idle" : "matching";
  heartbeat->backlog = static_cast<int32_t>(jobs_.size());
  heartbeat->num_done = num_done_;
  heartbeat->mean_s = num_done_ > 0 ? static_cast<float>(sum_elapsed_s_ / num_done_) : 0;
}

}  // namespace skein
