#include "merger/seed_policy.h"

#include <algorithm>
#include <array>
#include <map>
#include <set>

#include "core/angles.h"
#include "core/disjoint_sets.h"
#include "core/limits.h"
#include "covisibility/covisibility.h"
#include "session/submap_steps.h"

namespace skein {
namespace {

constexpr int kMinInliersAtLast = 50;  // when finishing and nothing better is left
// COLMAP's init_max_forward_motion. Pairs beyond it begin a map where all limits are relaxed: of a
// walk that looks ahead, or of a drone that rises, there is no other pair.
constexpr double kMaxForwardMotion = 0.95;
constexpr double kAnyMotion = 1.0;
// A relaxation of limits::kInitialAnglesDeg applies after so many quiet seconds. All apply when the
// session finishes.
constexpr std::array<double, limits::kInitialAnglesDeg.size() - 1> kRelaxQuietS = {3, 6, 9};
// While photos come, the best pair under a smaller angle waits until so many further orphans of
// its component brought none better: frames of a video begin under angles that still grow.
constexpr int kSmallAnglePatience = 4;
// A deferred photo waits until so many further photos were matched, or it is quiet.
constexpr int kDeferredPatience = 15;

// The pairs that the photo's own matches tell of, by the other photo's id: of two equally good
// pairs the first is chosen.
template <class Visit>
void ForEachOwnPair(const SessionState& session, int64_t image_id, const PhotoState& photo,
                    Visit visit) {
  std::vector<const CovisibilityGraph::Edge*> own;
  for (const CovisibilityGraph::Edge& edge : session.covisibility().EdgesOf(image_id)) {
    if (edge.seq == photo.matches_seq) own.push_back(&edge);
  }
  std::sort(own.begin(), own.end(),
            [](const auto* a, const auto* b) { return a->other_id < b->other_id; });
  for (const CovisibilityGraph::Edge* edge : own) visit(*edge);
}

// A photo at which a mapper failed three times begins no other submap.
bool HasFailedMappers(const SessionState& session, int64_t image_id) {
  const std::string step = PhotoStep(image_id);
  return std::any_of(session.submaps().begin(), session.submaps().end(),
                     [&](const auto& submap) { return submap.second.IsLeftOut(step); });
}

using Components = std::map<int64_t, int64_t>;  // image -> representative

// Both ends of a pair belong together even if the matches of the earlier photo are not known.
Components FindComponents(const SessionState& session) {
  DisjointSets<int64_t> sets;
  for (const auto& [image_id, photo] : session.photos()) {
    if (photo.matches_seq == 0) continue;
    sets.Find(image_id);
    for (const CovisibilityGraph::Edge& edge : session.covisibility().EdgesOf(image_id)) {
      if (edge.seq == photo.matches_seq) sets.Join(image_id, edge.other_id);
    }
  }
  return sets.Representatives();
}

bool MayStillBeReached(const PhotoState& photo, int64_t component, const Components& components,
                       const SubmapDirectory& directory) {
  for (const LiveSubmap& submap : directory.Live()) {
    if (submap.ledger_seq >= photo.matches_seq) continue;
    const auto touches = [&](int64_t id) {
      const auto it = components.find(id);
      return it != components.end() && it->second == component;
    };
    const seed_t& seed = submap.state->seed;
    if (submap.state->has_seed && (touches(seed.image_id1) || touches(seed.image_id2))) return true;
    for (const auto& [id, held] : submap.state->photos) {
      if (held.state == registration_t::REGISTERED && touches(id)) return true;
    }
  }
  return false;
}

bool IsPatient(int64_t image_id, const PhotoState& photo, const SubmapDirectory& directory,
               const SeedSituation& situation) {
  if (situation.finishing || !directory.IsDeferred(image_id)) return false;
  const bool quiet = situation.quiet_s >= kRelaxQuietS.back();
  const int64_t num_later = directory.session().num_matched() - photo.matches_order;
  return !quiet && num_later < kDeferredPatience;
}

std::vector<int64_t> Orphans(const SubmapDirectory& directory, const SeedSituation& situation,
                             const Components& components) {
  const SessionState& session = directory.session();
  std::vector<int64_t> orphans;
  for (const auto& [image_id, photo] : session.photos()) {
    if (photo.matches_seq == 0 || session.IsRegistered(image_id)) continue;
    if (HasFailedMappers(session, image_id)) continue;
    if (MayStillBeReached(photo, components.at(image_id), components, directory)) continue;
    if (IsPatient(image_id, photo, directory, situation)) continue;
    orphans.push_back(image_id);
  }
  return orphans;
}

size_t RelaxationOf(const SeedSituation& situation) {
  if (situation.finishing) return kRelaxQuietS.size();
  size_t step = 0;
  while (step < kRelaxQuietS.size() && situation.quiet_s >= kRelaxQuietS[step]) ++step;
  return step;
}

bool IsOutlasted(const SeedChoice& pair, const std::vector<int64_t>& orphans,
                 const SessionState& session) {
  const auto order = [&](int64_t id) { return session.FindPhoto(id)->matches_order; };
  const int64_t of_pair = std::max(order(pair.image_id1), order(pair.image_id2));
  return std::count_if(orphans.begin(), orphans.end(),
                       [&](int64_t id) { return order(id) > of_pair; }) >= kSmallAnglePatience;
}

}  // namespace

void SeedPolicy::OnRefused(int64_t image_id1, int64_t image_id2) {
  refused_.insert(std::minmax(image_id1, image_id2));
}

std::optional<SeedChoice> SeedPolicy::BestPair(const std::vector<int64_t>& orphans,
                                               double min_angle_rad, int min_inliers,
                                               double max_forward_motion,
                                               const SubmapDirectory& directory) const {
  const std::set<int64_t> is_orphan(orphans.begin(), orphans.end());
  const SessionState& session = directory.session();
  std::optional<SeedChoice> best;
  const auto consider = [&](int64_t image_id, const CovisibilityGraph::Edge& pair) {
    if (!is_orphan.count(pair.other_id) || session.WasSeeded(image_id, pair.other_id)) return;
    if (session.IsInLiveSeed(image_id) || session.IsInLiveSeed(pair.other_id)) return;
    if (refused_.count(std::minmax(image_id, pair.other_id))) return;
    const double angle_rad = pair.tri_angle_rad;
    if (pair.num_inliers < min_inliers || angle_rad < min_angle_rad ||
        pair.forward_motion > max_forward_motion) {
      return;
    }
    if (best && pair.num_inliers * angle_rad <= best->num_inliers * best->tri_angle_rad) return;
    if (session.covisibility().IsOfOneSpot(image_id, pair)) return;
    best = SeedChoice{image_id, pair.other_id, pair.num_inliers, angle_rad};
  };
  for (const int64_t image_id : orphans) {
    ForEachOwnPair(session, image_id, *session.FindPhoto(image_id),
                   [&](const CovisibilityGraph::Edge& pair) { consider(image_id, pair); });
  }
  return best;
}

std::optional<SeedChoice> SeedPolicy::ChooseIn(const std::vector<int64_t>& orphans,
                                               const SubmapDirectory& directory,
                                               const SeedSituation& situation) const {
  const size_t last_step = RelaxationOf(situation);
  for (size_t step = 0; step <= last_step; ++step) {
    const double min_angle_rad = DegToRad(limits::kInitialAnglesDeg[step]);
    const auto best =
        BestPair(orphans, min_angle_rad, limits::kMinSeedInliers, kMaxForwardMotion, directory);
    if (best) return best;
  }
  const double least_angle_rad = DegToRad(limits::kInitialAnglesDeg.back());
  const auto best =
      BestPair(orphans, least_angle_rad, limits::kMinSeedInliers, kAnyMotion, directory);
  const bool are_all_relaxed = last_step == kRelaxQuietS.size();
  if (best && (are_all_relaxed || IsOutlasted(*best, orphans, directory.session()))) return best;
  if (!situation.finishing) return std::nullopt;
  return BestPair(orphans, least_angle_rad, kMinInliersAtLast, kAnyMotion, directory);
}

std::optional<SeedChoice> SeedPolicy::Choose(const SubmapDirectory& directory,
                                             const SeedSituation& situation) const {
  const Components components = FindComponents(directory.session());
  std::map<int64_t, std::vector<int64_t>> by_component;
  for (const int64_t id : Orphans(directory, situation, components)) {
    by_component[components.at(id)].push_back(id);
  }
  std::optional<SeedChoice> best;
  for (const auto& [unused, orphans] : by_component) {
    const auto choice = ChooseIn(orphans, directory, situation);
    if (choice && (!best || choice->num_inliers * choice->tri_angle_rad >
                                best->num_inliers * best->tri_angle_rad)) {
      best = choice;
    }
  }
  return best;
}

}  // namespace skein
