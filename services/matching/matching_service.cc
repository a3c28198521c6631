#include "matching/matching_service.h"

#include <utility>

#include "core/attempt.h"
#include "core/log.h"
#include "ledger/work_items.h"
#include "matching/messages.h"

namespace skein {
namespace {

constexpr int kNumPhotosHeld = 2;
// Candidates that a photo is matched with while others wait: 30 would cost four times as much.
constexpr size_t kFirstPart = 8;
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
      work_(node, kMatchingKind, kNumPhotosHeld, [this](const work_t& work) { OnWork(work); }),
      follower_(node, 1, [this](const Fact& fact) { OnFact(fact); }) {
  for (int i = 0; i < node.options().threads; ++i) {
    workers_.emplace_back(node.loop(), options.cascade, options.kernel);
  }
  node.OnHeartbeat([this](heartbeat_t* heartbeat) { FillHeartbeat(heartbeat); });
}

void MatchingService::OnFact(const Fact& fact) {
  session_.Apply(fact);
  if (const auto* candidates = std::get_if<candidates_t>(&fact)) StartIfKnown(candidates->image_id);
  if (const auto* matches = std::get_if<matches_t>(&fact))
    StartIfKnown(RestItem(matches->image_id));
}

void MatchingService::OnWork(const work_t& work) {
  jobs_.try_emplace(work.item_id);
  TellCapacity();
  StartIfKnown(work.item_id);
}

// A rest, of which there is one at most, takes no photo's place.
void MatchingService::TellCapacity() {
  const bool has_rest = !jobs_.empty() && IsRestItem(jobs_.begin()->first);
  work_.SetCapacity(kNumPhotosHeld + (has_rest ? 1 : 0));
}

// The ledger may be behind the work: candidates, or a first part, that come later start the job.
void MatchingService::StartIfKnown(int64_t item) {
  const int64_t image_id = PhotoOfItem(item);
  const auto job = jobs_.find(item);
  if (job == jobs_.end() || job->second.look || !index_.HasCandidates(image_id)) return;
  const PhotoState& photo = *session_.FindPhoto(image_id);
  if (IsRestItem(item) && !photo.is_matched()) return;
  if (IsRestItem(item) && !photo.rest_due) return End(item);  // another worker has done it
  if (!index_.FindFeatures(image_id)) return Fail(item, "the photo has no features", true);
  const std::vector<int64_t> candidates = index_.CandidatesOf(image_id);
  const size_t num_named = photo.candidates.other_ids.size();
  if (candidates.size() < num_named) {
    LogWarn("candidates of image {}: {} are left out as doubled or without features", image_id,
            num_named - candidates.size());
  }
  job->second.look.emplace(
      candidates, session_.covisibility(), follower_.processed_seq(),
      [this, image_id](int64_t other_id) { return index_.IsEarlier(other_id, image_id); },
      second_look_);
  if (IsRestItem(item)) job->second.look->Resume(photo.tried);
  LoadPhoto(item);
}

void MatchingService::LoadPhoto(int64_t item) {
  const int64_t image_id = PhotoOfItem(item);
  loader_.Load(
      image_id, *index_.FindFeatures(image_id),
      [this, item](const Result<PhotoFeaturesPtr>& features) { OnPhotoLoaded(item, features); });
}

void MatchingService::OnPhotoLoaded(int64_t item, const Result<PhotoFeaturesPtr>& features) {
  if (!features.ok()) return Fail(item, features.error(), false);
  Job& job = jobs_.at(item);
  job.photo = *features;
  waiting_.insert(item);
  StartNext();
}

void MatchingService::StartNext() {
  if (waiting_.empty()) return;
  if (!active_) {
    active_ = *waiting_.begin();
    waiting_.erase(waiting_.begin());
    work_.SetCurrent(*active_);
    jobs_.at(*active_).since_begun = Timer();
    TakePairs();
  }
  Prefetch();
}

void MatchingService::TakePairs() {
  SecondLook& look = *jobs_.at(*active_).look;
  look.Advance(follower_.processed_seq());
  while (!MustYield()) {
    const std::optional<int64_t> other_id = look.Take();
    if (!other_id) break;
    LoadOther(*other_id);
  }
  if (MustYield() && look.Settle()) return Yield();
  if (look.num_in_work() > 0) return Prefetch();
  std::optional<CoarseSearch>& search = jobs_.at(*active_).search;
  if (search) return Submit(IsRestItem(*active_) ? matches_t::REST : matches_t::ALL);
  search.emplace(look.ToCompare());
  LookAtSome();
}

bool MatchingService::MustYield() const {
  if (waiting_.empty() || IsRestItem(*waiting_.begin())) return false;
  return IsRestItem(*active_) || jobs_.at(*active_).look->num_taken() >= kFirstPart;
}

void MatchingService::Yield() {
  const int64_t item = *active_;
  Job& job = jobs_.at(item);
  if (!IsRestItem(item)) {
    const bool has_rest =
        !job.look->Best(1).empty() || (!job.search && !job.look->ToCompare().empty());
    return Submit(has_rest ? matches_t::FIRST : matches_t::ALL);
  }
  job.matches.elapsed_s += job.since_begun.ElapsedS();
  waiting_.insert(item);
  active_.reset();
  StartNext();
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
  if (!waiting_.empty()) prefetch(*waiting_.begin());
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
  LogWarn("image {} is not matched with {}: {}", PhotoOfItem(*active_), other_id, reason);
  ++job->num_thrown;
  job->thrown = reason;
}

// The first part of a photo whose rest throws has been matched: such a rest has no pairs.
bool MatchingService::IsToBlame(int64_t item) const {
  const Job& job = jobs_.at(item);
  return !IsRestItem(item) && job.num_thrown >= kThrownToBlame && job.matches.num_tried == 0;
}

void MatchingService::FailActive() {
  const int64_t item = *active_;
  active_.reset();
  Fail(item, jobs_.at(item).thrown, false);
  StartNext();
}

void MatchingService::Submit(int8_t part) {
  const int64_t item = *active_;
  if (IsToBlame(item)) return FailActive();
  Job& job = jobs_.at(item);
  ++num_done_;
  job.matches.elapsed_s += job.since_begun.ElapsedS();
  sum_elapsed_s_ += job.matches.elapsed_s;
  std::vector<int64_t> tried;
  for (const SecondLook::Outcome& outcome : job.look->tried()) tried.push_back(outcome.other_id);
  workers_.front().thread.Run(
      [this, item, part, tried, seq = job.look->seq(), photo = job.photo,
       matches = std::move(job.matches)]() mutable {
        return Attempt([&] { return MakeFact(item, part, tried, seq, *photo, &matches); });
      },
      [this, item](Result<matches_t> fact) {
        OnFactMade(item, std::move(fact));
        MatchReadyPairs();  // the next photo's, for which this worker was not free
      });
  active_.reset();
  StartNext();
}

// On a worker's thread.
matches_t MatchingService::MakeFact(int64_t item, int8_t part, const std::vector<int64_t>& tried,
                                    int64_t seq, const PhotoFeatures& photo,
                                    PhotoMatches* matches) const {
  matches->Conclude(photo.points);
  const std::string blob =
      matches->pairs.empty() ? "" : node_.blobs().Offer(EncodeTwoViewPairs(matches->pairs));
  matches_t fact = ToMessage(PhotoOfItem(item), *matches, blob);
  SetPart(part, tried, &fact);
  fact.header.computed_at_seq = seq;
  return fact;
}

void MatchingService::OnFactMade(int64_t item, Result<matches_t> fact) {
  Status status = fact.status();
  if (status.ok()) status = Attempt([&] { SubmitFact(item, *std::move(fact)); });
  if (!status.ok()) Fail(item, status.error(), false);
}

void MatchingService::SubmitFact(int64_t item, matches_t fact) {
  LogDebug("image {}, part {}: {} of {} pairs verified, match {:.2f} s, verify {:.2f} s",
           fact.image_id, fact.part, fact.num_pairs, fact.num_tried, fact.match_s, fact.verify_s);
  node_.submitter().Submit(std::move(fact), [this, item](const Submission& done) {
    done.committed() ? End(item) : Fail(item, done.reason, true);
  });
}

void MatchingService::End(int64_t item) {
  jobs_.erase(item);
  work_.Done(item);
  TellCapacity();
}

void MatchingService::Fail(int64_t item, std::string reason, bool permanent) {
  LogWarn("image {}: {}", PhotoOfItem(item), reason);
  jobs_.erase(item);
  work_.Fail(item, reason, permanent);
  TellCapacity();
}

void MatchingService::FillHeartbeat(heartbeat_t* heartbeat) const {
  heartbeat->state = jobs_.empty() ? "idle" : "matching";
  heartbeat->backlog = static_cast<int32_t>(jobs_.size());
  heartbeat->num_done = num_done_;
  heartbeat->mean_s = num_done_ > 0 ? static_cast<float>(sum_elapsed_s_ / num_done_) : 0;
}

}  // namespace skein
