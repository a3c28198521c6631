#include "merger/merge_policy.h"

#include <algorithm>
#include <utility>

#include "session/photo_homes.h"

namespace skein {
namespace {

constexpr int kMinSharedWhenFinishing = 1;  // nothing more can come then
// Looked at in an attempt, of both submaps, beside shared ones. Neighbours of linked photos fill
// them up, and the whole attempt to as many: a thin link grows, as in one map.
constexpr int kMaxLinkedImages = 16;
constexpr double kGrowth = 1.5;  // of the photos, before what failed is tried again

using Direction = std::pair<int64_t, int64_t>;  // source, target
using Failures = std::map<Direction, int>;      // photos of the last attempt

// Failed attempts since the latest DRAINED: an UNDONE in its direction, a FAILED in both, as no
// similarity was found in either. At DRAINED the mappers have worked over their maps with all
// that the session has. An attempt that failed before may succeed now, and is made once more.
Failures FailuresOf(const SessionState& session) {
  Failures failures;
  const auto remember = [&failures](const Direction& direction, int num_images) {
    int& tried = failures[direction];
    tried = std::max(tried, num_images);
  };
  const int64_t since = session.last_drained_seq();
  for (const auto& [merge_id, merge] : session.merges()) {
    if (merge.latest().state != merge_t::UNDONE || merge_id < since) continue;
    const merge_t& ordered = merge.ordered();
    remember({ordered.source_id, ordered.target_id}, ordered.num_shared_images);
  }
  for (const merge_t& failed : session.failed_merges()) {
    if (failed.header.seq < since) continue;
    remember({failed.source_id, failed.target_id}, failed.num_shared_images);
    remember({failed.target_id, failed.source_id}, failed.num_shared_images);
  }
  return failures;
}

bool WasTried(const Failures& failures, const Direction& direction, int num_images,
              bool finishing) {
  const auto it = failures.find(direction);
  if (it == failures.end()) return false;
  const double needed = finishing ? it->second + 1.0 : kGrowth * it->second;
  return num_images < needed;
}

std::vector<int64_t> BestOf(const SubmapDirectory& directory, const SubmapDirectory::Pair& pair,
                            const Overlap& overlap) {
  std::vector<int64_t> images = overlap.shared;
  const size_t num_linked = std::min<size_t>(overlap.linked.size(), kMaxLinkedImages);
  images.insert(images.end(), overlap.linked.begin(), overlap.linked.begin() + num_linked);
  return directory.WithNeighbours(pair, std::move(images), kMaxLinkedImages);
}

// A larger map holds all its photos. It ends with the finish, and has nothing to add but the poses
// in which it differs: two photos of 48 stood at such ones.
bool IsNeedless(const SessionState& session, int64_t submap_id) {
  return HolderOfAll(session, submap_id) != 0;
}

}  // namespace

void MergeEvidence::Note(const SubmapDirectory::Overlaps& overlaps, int64_t utime_us) {
  for (const auto& [pair, overlap] : overlaps) {
    if (overlap.size() >= kMinSharedImages) since_utime_us_.emplace(pair, utime_us);
  }
}

void MergeEvidence::OnMerged(int64_t source_id, int64_t target_id) {
  const auto before = std::exchange(since_utime_us_, {});
  for (const auto& [pair, utime_us] : before) {
    const int64_t first = pair.first == source_id ? target_id : pair.first;
    const int64_t second = pair.second == source_id ? target_id : pair.second;
    if (first == second) continue;
    const auto added = since_utime_us_.emplace(std::minmax(first, second), utime_us).first;
    added->second = std::min(added->second, utime_us);
  }
}

int64_t MergeEvidence::UtimeOf(int64_t submap_id1, int64_t submap_id2) const {
  const auto found = since_utime_us_.find(std::minmax(submap_id1, submap_id2));
  return found == since_utime_us_.end() ? 0 : found->second;
}

std::optional<MergeAttempt> MergePolicy::Next(const SubmapDirectory& directory,
                                              bool finishing) const {
  if (!enabled_) return std::nullopt;
  const int min_shared = finishing ? kMinSharedWhenFinishing : kMinSharedImages;
  const SessionState& session = directory.session();
  const Failures failures = FailuresOf(session);
  std::optional<MergeAttempt> best;
  const Overlap* best_overlap = nullptr;
  for (const auto& [pair, overlap] : directory.FindOverlaps()) {
    if (overlap.size() < min_shared || directory.IsBusy(pair.first) ||
        directory.IsBusy(pair.second)) {
      continue;
    }
    if (best && overlap.size() <= best->num_images) continue;
    if (finishing && (IsNeedless(session, pair.first) || IsNeedless(session, pair.second)))
      continue;
    const bool a_is_smaller = session.FindSubmap(pair.first)->num_registered <
                              session.FindSubmap(pair.second)->num_registered;
    const Direction first = a_is_smaller ? pair : Direction{pair.second, pair.first};
    for (const Direction& direction : {first, Direction{first.second, first.first}}) {
      if (WasTried(failures, direction, overlap.size(), finishing)) continue;
      best = MergeAttempt{
          direction.first, direction.second, {}, overlap.size(), session.last_drained_seq()};
      best_overlap = &overlap;
      break;
    }
  }
  if (best) best->images = BestOf(directory, {best->source_id, best->target_id}, *best_overlap);
  return best;
}

bool MergePolicy::IsBetterReversed(const MergeAttempt& attempt, const std::vector<int64_t>& inliers,
                                   const SubmapDirectory& directory) const {
  const SessionState& session = directory.session();
  const auto num_in = [&](int64_t submap_id) {
    const SubmapLife& submap = *session.FindSubmap(submap_id);
    return std::count_if(inliers.begin(), inliers.end(),
                         [&](int64_t id) { return submap.IsRegistered(id); });
  };
  const auto needed = std::min<std::ptrdiff_t>(kMinSharedImages, static_cast<int>(inliers.size()));
  return num_in(attempt.source_id) < needed && num_in(attempt.target_id) >= needed &&
         !WasTried(FailuresOf(session), {attempt.target_id, attempt.source_id}, attempt.num_images,
                   true);
}

}  // namespace skein
