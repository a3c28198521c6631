#include "guidance/place_summary.h"

#include <cmath>

#include "core/counted.h"

namespace skein {
namespace {

constexpr size_t kMinPhotos = 5, kMinSurfels = 20;  // below it is too early to say

}  // namespace

PlaceSummary SummarisePlace(const PlaceQuality& place, size_t num_photos) {
  PlaceSummary summary;
  summary.num_photos = num_photos;
  for (size_t i = 0; i < place.surfels.size(); ++i) {
    summary.num_surfels += place.surface.surfels[i].IsGone() ? 0 : 1;
    summary.num_open += place.Counts(i) && place.surface.surfels[i].open_border ? 1 : 0;
  }
  summary.completeness = place.completeness;
  summary.verdict = VerdictOfPlace(place.completeness, num_photos, summary.num_surfels);
  summary.sentence =
      PlaceSentence(summary.verdict, place.completeness, num_photos, summary.num_open);
  return summary;
}

PlaceVerdict VerdictOfPlace(const Completeness& completeness, size_t num_photos,
                            size_t num_surfels) {
  constexpr double kNearlyGood = 0.8;  // of what completeness asks for
  constexpr double kNearlyOpen = 0.3;
  if (num_photos < kMinPhotos || num_surfels < kMinSurfels) return PlaceVerdict::kGrowing;
  if (completeness.complete) return PlaceVerdict::kComplete;
  const bool nearly = completeness.GoodOfShown() >= kNearlyGood * kMinGoodShare &&
                      completeness.open_share <= kNearlyOpen;
  return nearly ? PlaceVerdict::kNearly : PlaceVerdict::kWeak;
}

std::string PlaceSentence(PlaceVerdict verdict, const Completeness& completeness, size_t num_photos,
                          size_t num_open) {
  constexpr double kMuchGround = 0.02;
  if (verdict == PlaceVerdict::kGrowing) {
    return "too little to say yet, with " + std::to_string(num_photos) + " photos: keep going";
  }
  // Not 100 % where something is missing.
  const int percent = static_cast<int>(std::floor(100 * completeness.good_share));
  std::string text = std::to_string(percent) + " % of the surface is good";
  const int holes_percent = static_cast<int>(std::ceil(100 * completeness.hole_share));
  if (holes_percent > 1) {
    text += ", " + std::to_string(holes_percent) + " % of what the photos show has no points";
  }
  if (num_open > 0) {
    text += ", " + Counted(num_open, "open border");
  }
  if (completeness.ground_share > kMuchGround) text += ", not counting the ground";
  if (verdict == PlaceVerdict::kComplete) return text + ": complete";
  return text + (verdict == PlaceVerdict::kNearly ? ": nearly complete" : ": keep going");
}

}  // namespace skein
