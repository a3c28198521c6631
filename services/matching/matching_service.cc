#include "matching/matching_service.h"

#include <utility>

#include "core/attempt.h"
#include "core/log.h"
#include "matching/messages.h"

namespace skein {
namespace {

constexpr size_t kPrefetched = 8;
constexpr size_t kLookedAtOnce = 16;
// Pairs that throw, and share the photo alone: of one pair either photo may be to blame.
constexpr int kThrownToBlame = 2;

// Null without the cascade.
std::shared_ptr<const DescriptorCells> CellsOf(const MatchingServiceOptions& options) {
  if (!options.cascade) return nullptr;
  return std::make_shared<DescriptorCells>(CodebookOf(options.codebook_path), options.kernel);
}

}  // namespace

MatchingService::MatchingService(Node& node, const MatchingServiceOptions& options)
    : node_(node),
      second_look_(options.second_look),
      loader_(node.loop(), node.blobs(), CellsOf(options),
              static_cast<size_t>(options.cache_mib) << 20),
      work_(node, "matching", 2, [this](const work_t& work) { OnWork(work); }),
      follower_(node, 1, [this](const Fact& fact) { OnFact(fact); }) {
  for (int i = 0; i < node.options().threads; ++i) {
    workers_.emplace_back(node.loop(), options.cascade, options.kernel);
  }
  node.OnHeartbeat([this](heartbeat_t* heartbeat) { FillHeartbeat(heartbeat); });
}

void MatchingService::OnFact(const Fact& fact) {
  session_.Apply(fact);
  if (const auto* candidates = std::get_if<candidates_t>(&fact)) StartIfKnown(candidates->image_id);
}

void MatchingService::OnWork(const work_t& work) {
  jobs_.try_emplace(work.item_id);
  StartIfKnown(work.item_id);
}

// The ledger may be behind the work: candidates that come later start the job.
void MatchingService::StartIfKnown(int64_t image_id) {
  const auto job = jobs_.find(image_id);
  if (job == jobs_.end() || job->second.look || !index_.HasCandidates(image_id)) return;
  if (!index_.FindFeatures(image_id)) return Fail(image_id, "the photo has no features", true);
  const std::vector<int64_t> candidates = index_.CandidatesOf(image_id);
  const size_t num_named = session_.FindPhoto(image_id)->candidates.other_ids.size();
  if (candidates.size() < num_named) {
    LogWarn("candidates of image {}: {} are left out as doubled or without features", image_id,
            num_named - candidates.size());
  }
  job->second.look.emplace(
      candidates, session_.covisibility(), follower_.processed_seq(),
      [this, image_id](int64_t other_id) { return index_.IsEarlier(other_id, image_id); },
      second_look_);
  LoadPhoto(image_id);
}

void MatchingService::LoadPhoto(int64_t image_id) {
  loader_.Load(image_id, *index_.FindFeatures(image_id),
               [this, image_id](const Result<PhotoFeaturesPtr>& features) {
                 OnPhotoLoaded(image_id, features);
               });
}

void MatchingService::OnPhotoLoaded(int64_t image_id, const Result<PhotoFeaturesPtr>& features) {
  if (!features.ok()) return Fail(image_id, features.error(), false);
  Job& job = jobs_.at(image_id);
  job.photo = *features;
  waiting_.push_back(image_id);
  StartNext();
}

void MatchingService::StartNext() {
  if (waiting_.empty()) return;
  if (!active_) {
    active_ = waiting_.front();
    waiting_.pop_front();
    jobs_.at(*active_).since_begun = Timer();
    TakePairs();
  }
  Prefetch();
}

void MatchingService::TakePairs() {
  SecondLook& look = *jobs_.at(*active_).look;
  look.Advance(follower_.processed_seq());
  while (const std::optional<int64_t> other_id = look.Take()) LoadOther(*other_id);
  if (look.num_in_work() > 0) return Prefetch();
  std::optional<CoarseSearch>& search = jobs_.at(*active_).search;
  if (search) return Submit();
  search.emplace(look.ToCompare());
  LookAtSome();
}

void MatchingService::LookAtSome() {
  Job& job = jobs_.at(*active_);
  const std::vector<int64_t> ids = job.search->Take(kLookedAtOnce);
  if (ids.empty()) {
    job.look->Choose(job.search->Best());
    return TakePairs();
  }
  const auto others = std::make_shared<std::vector<PhotoFeaturesPtr>>();
  const auto num_missing = std::make_shared<size_t>(ids.size());
  for (const int64_t id : ids) {
    loader_.LoadCoarsest(id, *index_.FindFeatures(id),
                         [this, others, num_missing](const Result<PhotoFeaturesPtr>& features) {
                           if (features.ok()) others->push_back(*features);
                           if (--*num_missing == 0) CountMatches(std::move(*others));
                         });
  }
}

void MatchingService::CountMatches(std::vector<PhotoFeaturesPtr> others) {
  using Counts = std::vector<std::pair<int64_t, int>>;
  Worker& worker = workers_.front();
  worker.thread.Run(
      [this, &worker, photo = jobs_.at(*active_).photo, others = std::move(others)] {
        Counts counts;
        for (const PhotoFeaturesPtr& other : others)
          counts.emplace_back(other->image_id, TryToCount(&worker.matcher, *photo, *other));
        return counts;
      },
      [this](const Counts& counts) {
        for (const auto& [id, num_matches] : counts)
          jobs_.at(*active_).search->Tell(id, num_matches);
        LookAtSome();
      });
}

int MatchingService::TryToCount(PairMatcher* matcher, const PhotoFeatures& photo,
                                const PhotoFeatures& other) const {
  const Result<int> count = Attempt([&] {
    if (on_pair_) on_pair_(photo.image_id, other.image_id);
    return matcher->CountCoarseMatches(photo, other);
  });
  if (count.ok()) return *count;
  LogWarn("image {} is not compared with {}: {}", photo.image_id, other.image_id, count.error());
  return 0;
}

void MatchingService::LoadOther(int64_t other_id) {
  loader_.Load(other_id, *index_.FindFeatures(other_id),
               [this, other_id](const Result<PhotoFeaturesPtr>& features) {
                 if (!features.ok()) {
                   LogWarn("image {} is not matched with {}: {}", *active_, other_id,
                           features.error());
                 }
                 ready_.push_back({other_id, features.ok() ? *features : nullptr});
                 MatchReadyPairs();
               });
}

// Photos that are likely to be matched after those in work.
void MatchingService::Prefetch() {
  const auto prefetch = [this](int64_t image_id) {
    for (const int64_t id : jobs_.at(image_id).look->Best(kPrefetched)) {
      loader_.Load(id, *index_.FindFeatures(id), [](const Result<PhotoFeaturesPtr>&) {});
    }
  };
  if (active_) prefetch(*active_);
  if (!waiting_.empty()) prefetch(waiting_.front());
}

void MatchingService::MatchReadyPairs() {
  for (Worker& worker : workers_) {
    if (ready_.empty()) return;
    if (worker.thread.num_pending() > 0) continue;
    const ReadyPair pair = std::move(ready_.front());
    ready_.pop_front();
    worker.thread.Run([this, &worker, photo = jobs_.at(*active_).photo,
                       other = pair.other] { return TryToMatch(&worker.matcher, *photo, other); },
                      [this, other_id = pair.other_id](const Result<PairResult>& result) {
                        OnPairMatched(other_id, result);
                      });
  }
}

Result<PairResult> MatchingService::TryToMatch(PairMatcher* matcher, const PhotoFeatures& photo,
                                               const PhotoFeaturesPtr& other) const {
  if (other == nullptr) return DataLoss("its features are damaged");
  return Attempt([&] {
    if (on_pair_) on_pair_(photo.image_id, other->image_id);
    return matcher->Match(photo, *other);
  });
}

void MatchingService::OnPairMatched(int64_t other_id, const Result<PairResult>& result) {
  Job& job = jobs_.at(*active_);
  if (result.code() == StatusCode::kUnavailable) NoteThrown(other_id, result.error(), &job);
  const bool is_verified = result.ok() && IsVerified(result->geometry);
  if (result.ok()) job.matches.Add(other_id, *result);
  job.look->Tell(other_id,
                 is_verified ? static_cast<int32_t>(result->geometry.inlier_matches.size()) : 0);
  MatchReadyPairs();
  TakePairs();
}

void MatchingService::NoteThrown(int64_t other_id, const std::string& reason, Job* job) {
  LogWarn("image {} is not matched with {}: {}", *active_, other_id, reason);
  ++job->num_thrown;
  job->thrown = reason;
}

bool MatchingService::IsToBlame(int64_t image_id) const {
  const Job& job = jobs_.at(image_id);
  return job.num_thrown >= kThrownToBlame && job.matches.num_tried == 0;
}

void MatchingService::FailActive() {
  const int64_t image_id = *active_;
  active_.reset();
  Fail(image_id, jobs_.at(image_id).thrown, false);
  StartNext();
}

void MatchingService::Submit() {
  const int64_t image_id = *active_;
  if (IsToBlame(image_id)) return FailActive();
  Job& job = jobs_.at(image_id);
  ++num_done_;
  job.matches.elapsed_s = job.since_begun.ElapsedS();
  sum_elapsed_s_ += job.matches.elapsed_s;
  workers_.front().thread.Run(
      [this, image_id, seq = job.look->seq(), photo = job.photo,
       apart = PairsApart(session_.covisibility(), job.matches.other_ids()),
       matches = std::move(job.matches)]() mutable {
        return Attempt([&] {
          matches.Conclude(photo->points, apart);
          return MakeFact(image_id, seq, matches);
        });
      },
      [this, image_id](Result<matches_t> fact) {
        OnFactMade(image_id, std::move(fact));
        MatchReadyPairs();  // the next photo's, for which this worker was not free
      });
  active_.reset();
  StartNext();
}

// On a worker's thread.
matches_t MatchingService::MakeFact(int64_t image_id, int64_t seq,
                                    const PhotoMatches& matches) const {
  const std::string blob =
      matches.pairs.empty() ? "" : node_.blobs().Offer(EncodeTwoViewPairs(matches.pairs));
  matches_t fact = ToMessage(image_id, matches, blob);
  fact.header.computed_at_seq = seq;
  return fact;
}

void MatchingService::OnFactMade(int64_t image_id, Result<matches_t> fact) {
  Status status = fact.status();
  if (status.ok()) status = Attempt([&] { SubmitFact(image_id, *std::move(fact)); });
  if (!status.ok()) Fail(image_id, status.error(), false);
}

void MatchingService::SubmitFact(int64_t image_id, matches_t fact) {
  LogDebug("image {}: {} of {} pairs verified, match {:.2f} s, verify {:.2f} s", image_id,
           fact.num_pairs, fact.num_tried, fact.match_s, fact.verify_s);
  node_.submitter().Submit(std::move(fact), [this, image_id](const Submission& done) {
    if (!done.committed()) return Fail(image_id, done.reason, true);
    jobs_.erase(image_id);
    work_.Done(image_id);
  });
}

void MatchingService::Fail(int64_t image_id, std::string reason, bool permanent) {
  LogWarn("image {}: {}", image_id, reason);
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
