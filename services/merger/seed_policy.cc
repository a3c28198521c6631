#include "merger/seed_policy.h"

#include <algorithm>
#include <set>
#include <stdexcept>

#include "core/option_check.h"

namespace skein {
namespace {

constexpr double kRadPerDeg = 3.14159265358979323846 / 180.0;

}  // namespace

Status SeedOptions::Check() const {
  if (min_tri_angle_steps_deg.empty()) return InvalidArgument("min_tri_angle_steps_deg is empty");
  const size_t num_relaxations = min_tri_angle_steps_deg.size() - 1;
  if (relax_orphans.size() != num_relaxations || relax_quiet_s.size() != num_relaxations) {
    return InvalidArgument("relax_orphans and relax_quiet_s need one entry for each relaxation");
  }
  return FirstError({InRange("seed_min_inliers", min_inliers, 15, 100'000),
                     InRange("seed_min_inliers_at_last", min_inliers_at_last, 15, min_inliers)});
}

SeedPolicy::SeedPolicy(const SeedOptions& options) : options_(options) {
  if (const Status checked = options.Check(); !checked.ok()) {
    throw std::invalid_argument(checked.error());
  }
}

void SeedPolicy::OnMatches(int64_t image_id, int64_t seq, const std::vector<VerifiedPair>& pairs) {
  const auto [it, inserted] = photos_.try_emplace(image_id);
  if (inserted) it->second.order = static_cast<int64_t>(photos_.size());
  it->second.seq = seq;
  for (const VerifiedPair& pair : pairs) it->second.pairs[pair.other_id] = pair;
}

void SeedPolicy::OnRefused(int64_t image_id1, int64_t image_id2) {
  refused_.insert(std::minmax(image_id1, image_id2));
}

// Representatives by path halving; both ends of a pair belong together even if the matches of the
// earlier photo are not known.
SeedPolicy::Components SeedPolicy::FindComponents() const {
  Components parent;
  const auto find = [&parent](int64_t id) {
    parent.try_emplace(id, id);
    while (parent[id] != id) id = parent[id] = parent[parent[id]];
    return id;
  };
  for (const auto& [image_id, photo] : photos_) {
    find(image_id);
    for (const auto& [other_id, unused] : photo.pairs) parent[find(image_id)] = find(other_id);
  }
  Components components;
  for (const auto& [id, unused] : Components(parent)) components[id] = find(id);
  return components;
}

bool SeedPolicy::MayStillBeReached(const Photo& photo, int64_t component,
                                   const Components& components,
                                   const SubmapDirectory& directory) const {
  for (const SubmapEntry* submap : directory.Live()) {
    if (submap->ledger_seq >= photo.seq) continue;
    const auto touches = [&](int64_t id) {
      const auto it = components.find(id);
      return it != components.end() && it->second == component;
    };
    if (touches(submap->image_id1) || touches(submap->image_id2)) return true;
    for (const int64_t id : submap->registered) {
      if (touches(id)) return true;
    }
  }
  return false;
}

bool SeedPolicy::IsPatient(int64_t image_id, const Photo& photo, const SubmapDirectory& directory,
                           const SeedSituation& situation) const {
  if (situation.finishing || !directory.IsDeferred(image_id)) return false;
  const bool quiet =
      !options_.relax_quiet_s.empty() && situation.quiet_s >= options_.relax_quiet_s.back();
  const int64_t num_later = static_cast<int64_t>(photos_.size()) - photo.order;
  return !quiet && num_later < options_.deferred_patience;
}

std::vector<int64_t> SeedPolicy::Orphans(const SubmapDirectory& directory,
                                         const SeedSituation& situation) const {
  const Components components = FindComponents();
  std::vector<int64_t> orphans;
  for (const auto& [image_id, photo] : photos_) {
    if (directory.IsRegistered(image_id)) continue;
    if (MayStillBeReached(photo, components.at(image_id), components, directory)) continue;
    if (IsPatient(image_id, photo, directory, situation)) continue;
    orphans.push_back(image_id);
  }
  return orphans;
}

size_t SeedPolicy::RelaxationOf(size_t num_orphans, const SeedSituation& situation) const {
  const size_t num_relaxations = options_.relax_orphans.size();
  if (situation.finishing) return num_relaxations;
  size_t step = 0;
  while (step < num_relaxations &&
         (num_orphans >= static_cast<size_t>(options_.relax_orphans[step]) ||
          situation.quiet_s >= options_.relax_quiet_s[step])) {
    ++step;
  }
  return step;
}

std::optional<SeedChoice> SeedPolicy::BestPair(const std::vector<int64_t>& orphans,
                                               double min_angle_rad, int min_inliers,
                                               const SubmapDirectory& directory) const {
  const std::set<int64_t> is_orphan(orphans.begin(), orphans.end());
  std::optional<SeedChoice> best;
  for (const int64_t image_id : orphans) {
    for (const auto& [other_id, pair] : photos_.at(image_id).pairs) {
      if (!is_orphan.count(other_id) || directory.WasSeeded(image_id, other_id)) continue;
      if (refused_.count(std::minmax(image_id, other_id))) continue;
      if (pair.num_inliers < min_inliers || pair.tri_angle_rad < min_angle_rad ||
          pair.forward_motion > options_.max_forward_motion) {
        continue;
      }
      if (best &&
          pair.num_inliers * pair.tri_angle_rad <= best->num_inliers * best->tri_angle_rad) {
        continue;
      }
      best = SeedChoice{image_id, other_id, pair.num_inliers, pair.tri_angle_rad};
    }
  }
  return best;
}

std::optional<SeedChoice> SeedPolicy::ChooseIn(const std::vector<int64_t>& orphans,
                                               const SubmapDirectory& directory,
                                               const SeedSituation& situation) const {
  const size_t last_step = RelaxationOf(orphans.size(), situation);
  for (size_t step = 0; step <= last_step; ++step) {
    const double min_angle_rad = options_.min_tri_angle_steps_deg[step] * kRadPerDeg;
    const auto best = BestPair(orphans, min_angle_rad, options_.min_inliers, directory);
    if (best) return best;
  }
  if (!situation.finishing) return std::nullopt;
  return BestPair(orphans, options_.min_tri_angle_steps_deg.back() * kRadPerDeg,
                  options_.min_inliers_at_last, directory);
}

std::optional<SeedChoice> SeedPolicy::Choose(const SubmapDirectory& directory,
                                             const SeedSituation& situation) const {
  const Components components = FindComponents();
  std::map<int64_t, std::vector<int64_t>> by_component;
  for (const int64_t id : Orphans(directory, situation)) {
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
