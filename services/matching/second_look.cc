#include "matching/second_look.h"

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <unordered_set>
#include <utility>

namespace skein {
namespace {

constexpr size_t kMaxInWork = 3;  // pairs at once
constexpr double kPriorWeight = 0.5;
constexpr size_t kNumSure = 20;
constexpr size_t kShortlist = 30;
constexpr double kMinEvidence = 0.5;        // as a tried photo that shows half of it gives
constexpr double kMinExpected = 0.23;       // of the 15 inliers that keep a pair
constexpr double kMinExpectedJoined = 0.5;  // of kOverlapping inliers
constexpr double kMaxImplied = 0.5;
constexpr size_t kMaxJoined = 10;  // photos outside of the shortlist

constexpr int32_t kOverlapping = 50;  // inliers
// Overlapping pairs.
constexpr size_t kNumConnected = 3;
constexpr size_t kFewStrong = 6;
constexpr size_t kMinStrong = 12;

constexpr int64_t kFromTheStart = std::numeric_limits<int64_t>::min();

double Strength(int32_t num_inliers) {
  return static_cast<double>(num_inliers) / (num_inliers + kOverlapping);
}

}  // namespace

SecondLook::SecondLook(const std::vector<int64_t>& candidates, const CovisibilityGraph& graph,
                       int64_t seq, MayJoin may_join, bool enabled)
    : graph_(graph),
      seq_(seq),
      may_join_(std::move(may_join)),
      enabled_(enabled),
      order_(candidates) {
  for (size_t rank = 0; rank < candidates.size(); ++rank) {
    Candidate& candidate = candidates_[candidates[rank]];
    candidate.shortlisted = rank < kShortlist;
    candidate.rank = rank;
    candidate.prior = 1.0 / static_cast<double>(2 + rank);
  }
}

bool SecondLook::IsInformed(const Candidate& candidate) { return candidate.weight >= kMinEvidence; }

double SecondLook::Expected(const Candidate& candidate) {
  return (kPriorWeight * candidate.prior + candidate.weighted) / (kPriorWeight + candidate.weight);
}

double SecondLook::ExpectedInliers(const Candidate& candidate) {
  return Expected(candidate) * candidate.bottleneck;
}

bool SecondLook::IsWorthwhile(const Candidate& candidate) const {
  if (candidate.taken) return false;
  if (candidate.chosen) return true;
  if (!enabled_) return candidate.shortlisted;
  if (!candidate.shortlisted && num_joined_ >= kMaxJoined) return false;
  const bool is_sure =
      candidate.shortlisted && (candidate.rank < kNumSure || num_strong_ < kFewStrong);
  if (!IsInformed(candidate)) return is_sure;
  const double needed = is_sure ? kMinExpected : kMinExpectedJoined;
  if (Expected(candidate) < needed) return false;
  return num_strong_ < kMinStrong || 1 - candidate.not_implied < kMaxImplied;
}

bool SecondLook::IsLonely(int64_t image_id) const {
  const auto& edges = graph_.EdgesOf(image_id);
  const auto num_strong = std::count_if(edges.begin(), edges.end(), [this](const auto& edge) {
    return edge.seq <= seq_ && edge.num_inliers >= kOverlapping;
  });
  return static_cast<size_t>(num_strong) < kNumConnected;
}

std::vector<int64_t> SecondLook::ToCompare() const {
  std::vector<int64_t> ids;
  if (!enabled_) return ids;
  for (const int64_t id : order_) {
    const Candidate& candidate = candidates_.at(id);
    const bool is_wanted = num_strong_ < kNumConnected || IsLonely(id);
    if (!candidate.taken && is_wanted) ids.push_back(id);
  }
  return ids;
}

void SecondLook::Choose(const std::vector<int64_t>& ids) {
  for (const int64_t id : ids) candidates_.at(id).chosen = true;
}

std::vector<int64_t> SecondLook::WorthwhileBestFirst() const {
  std::vector<std::pair<double, int64_t>> worthwhile;
  for (const int64_t id : order_) {
    const Candidate& candidate = candidates_.at(id);
    if (IsWorthwhile(candidate)) worthwhile.emplace_back(ExpectedInliers(candidate), id);
  }
  std::stable_sort(worthwhile.begin(), worthwhile.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  std::vector<int64_t> ids;
  for (const auto& [expected, id] : worthwhile) ids.push_back(id);
  return ids;
}

std::vector<int64_t> SecondLook::Best(size_t count) const {
  std::vector<int64_t> best;
  // Those that one in work or one of the best will speak for.
  std::unordered_set<int64_t> waiting;
  const auto will_speak = [this, &waiting](int64_t id) {
    if (!enabled_) return;
    for (const CovisibilityGraph::Edge& edge : graph_.EdgesOf(id)) {
      if (edge.seq <= seq_) waiting.insert(edge.other_id);
    }
  };
  for (const InWork& pair : in_work_) will_speak(pair.other_id);
  for (const int64_t id : WorthwhileBestFirst()) {
    if (best.size() == count) break;
    if (waiting.count(id) > 0 && !IsInformed(candidates_.at(id))) continue;
    best.push_back(id);
    will_speak(id);
  }
  return best;
}

std::optional<int64_t> SecondLook::Take() {
  while (true) {
    const auto best = in_work_.size() < kMaxInWork ? Best(1) : std::vector<int64_t>();
    if (!best.empty()) {
      Candidate& taken = candidates_.at(best.front());
      taken.taken = true;
      num_joined_ += !taken.shortlisted;
      in_work_.push_back({best.front(), std::nullopt});
      return best.front();
    }
    if (in_work_.empty() || !in_work_.front().num_inliers) return std::nullopt;
    LearnFirstInWork();
  }
}

void SecondLook::LearnFirstInWork() {
  told_.push_back({in_work_.front().other_id, *in_work_.front().num_inliers});
  in_work_.pop_front();
  num_strong_ += told_.back().num_inliers >= kOverlapping;
  Learn(told_.back(), kFromTheStart);
}

void SecondLook::Tell(int64_t other_id, int32_t num_inliers) {
  const auto told = std::find_if(in_work_.begin(), in_work_.end(), [other_id](const InWork& pair) {
    return pair.other_id == other_id && !pair.num_inliers;
  });
  if (told == in_work_.end()) throw std::invalid_argument("told of a pair that is not in work");
  told->num_inliers = num_inliers;
}

void SecondLook::Advance(int64_t seq) {
  if (seq <= seq_) return;
  const int64_t before = std::exchange(seq_, seq);
  for (const Outcome& outcome : told_) Learn(outcome, before);
}

double SecondLook::WeightOf(const CovisibilityGraph::Edge& edge) const {
  int32_t most = 1;
  for (const CovisibilityGraph::Edge& of_c : graph_.EdgesOf(edge.other_id)) {
    if (of_c.seq <= seq_) most = std::max(most, of_c.num_inliers);
  }
  return Strength(edge.num_inliers) * edge.num_inliers / most;
}

void SecondLook::Learn(const Outcome& outcome, int64_t after_seq) {
  if (!enabled_) return;
  const int32_t num_inliers = outcome.num_inliers;
  for (const CovisibilityGraph::Edge& edge : graph_.EdgesOf(outcome.other_id)) {
    if (edge.seq <= after_seq || edge.seq > seq_) continue;
    auto found = candidates_.find(edge.other_id);
    if (found == candidates_.end()) {
      if (num_inliers == 0 || !may_join_(edge.other_id)) continue;
      found = candidates_.try_emplace(edge.other_id).first;
      order_.push_back(edge.other_id);
    }
    Candidate& candidate = found->second;
    const double weight = WeightOf(edge);
    candidate.bottleneck = std::max(candidate.bottleneck, std::min(edge.num_inliers, num_inliers));
    candidate.weight += weight;
    candidate.weighted += weight * Strength(num_inliers);
    candidate.not_implied *= 1 - weight * Strength(num_inliers);
  }
}

}  // namespace skein
