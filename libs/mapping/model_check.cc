#include "mapping/model_check.h"

#include <algorithm>
#include <cmath>

#include "bundle/loosest_mode.h"

namespace skein {
namespace {

// A photo's observations share errors with their neighbours (localisation, lens, mismatches). More
// than this many count as this many. The priors of the cameras are weighed so, too
// (bundle_builder.cc).
constexpr double kIndependentObservations = 100;

double ErrorFactor(const Bundle& bundle) {
  const double per_photo =
      static_cast<double>(bundle.observations.size()) / static_cast<double>(bundle.poses.size());
  return std::sqrt(std::max(1.0, per_photo / kIndependentObservations));
}

}  // namespace

ShapeCheck CheckShape(const Bundle& bundle) {
  ShapeCheck check;
  if (bundle.poses.size() < 3) return check;
  const double extent = ExtentOf(bundle);
  const std::optional<LoosestMode> mode = FindLoosestMode(bundle);
  const double error = mode ? ErrorFactor(bundle) * mode->expected_error : extent;
  if (!(error < extent)) {
    check.position_sigma = 1;
    return check;
  }
  check.position_sigma = error / extent;
  const WeakestCut cut = FindWeakestCut(bundle, mode->displacements);
  if (cut.loose < 0) return check;
  check.loose_image = bundle.poses[cut.loose].image_id;
  check.anchor_image = bundle.poses[cut.anchor].image_id;
  check.num_loose_images = cut.num_loose;
  return check;
}

PairCheck CheckPairs(const MisplacedOptions& options, const SceneMap& map) {
  PairCheck check;
  int largest_surplus = 0;
  for (const auto& [id1, id2] : map.pairs()) {
    if (!map.IsRegistered(id1) || !map.IsRegistered(id2)) continue;
    const Votes votes = CountVotes(options, map, id1, id2);
    check.num_pairs += votes.Sum() > 0;
    const int surplus = votes.contradict - votes.agree;
    if (surplus < options.min_contradiction) continue;
    ++check.num_contradicting;
    if (surplus <= largest_surplus) continue;
    largest_surplus = surplus;
    check.strongest1 = std::min(id1, id2);
    check.strongest2 = std::max(id1, id2);
    check.num_contradicting_matches = votes.contradict;
  }
  return check;
}

}  // namespace skein
