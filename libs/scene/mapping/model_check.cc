#include "mapping/model_check.h"

#include <algorithm>

#include "bundle/loosest_mode.h"

namespace skein {
namespace {

// True position error over the expected one: 3.8 in the geometric mean of 14 maps, real and
// simulated (docs/experiments/bent_maps.md). Photos share errors, of the lens and of matching.
constexpr double kSharedErrors = 4;

}  // namespace

ShapeCheck CheckShape(const Bundle& bundle, int num_threads) {
  ShapeCheck check;
  if (bundle.poses.size() < 3) return check;
  const SpanningTree tree = MaximumSpanningTree(bundle);
  if (const auto tie = FindThinnestCut(bundle, tree, kMinTie)) {
    return {1, bundle.poses[tie->loose].image_id, bundle.poses[tie->anchor].image_id,
            static_cast<int>(tie->loose_side.size())};
  }
  const double extent = ExtentOf(bundle);
  const std::optional<LoosestMode> mode = FindLoosestMode(bundle, num_threads);
  const double error = mode ? kSharedErrors * mode->expected_error : extent;
  if (!(error < extent)) {
    check.position_sigma = 1;
    return check;
  }
  check.position_sigma = error / extent;
  const WeakestCut cut = FindWeakestCut(bundle, tree, mode->displacements);
  if (cut.loose < 0) return check;
  check.loose_image = bundle.poses[cut.loose].image_id;
  check.anchor_image = bundle.poses[cut.anchor].image_id;
  check.num_loose_images = cut.num_loose;
  return check;
}

MatchCheck CheckMatches(const SceneMap& map) {
  MatchCheck check;
  for (const auto& [id1, id2] : map.pairs()) {
    if (!map.IsRegistered(id1) || !map.IsRegistered(id2)) continue;
    Votes votes = CountCommonPoints(map, id1, id2);
    bool contradicts = IsTorn(votes);
    // Only matches without a common point can contradict the poses.
    if (contradicts || votes.contradict >= kMinContradiction) {
      const Votes on_poses = CountVotes(map, id1, id2);
      if (on_poses.contradict - on_poses.agree >= kMinContradiction) {
        contradicts = true;
        votes = on_poses;
      }
    }
    check.num_matches += votes.Sum();
    if (!contradicts) continue;
    check.num_contradicting += votes.contradict;
    if (votes.contradict <= check.num_of_strongest) continue;
    check.strongest1 = std::min(id1, id2);
    check.strongest2 = std::max(id1, id2);
    check.num_of_strongest = votes.contradict;
  }
  return check;
}

}  // namespace skein
