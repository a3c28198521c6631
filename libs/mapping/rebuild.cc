#include "mapping/rebuild.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "core/limits.h"
#include "mapping/registration.h"

namespace skein {
namespace {

void Ignore(const PhotoEvent&) {}

std::vector<ImageId> NeighboursMostInliersFirst(const SceneMap& map, ImageId id) {
  std::vector<std::pair<int, ImageId>> ranked;
  for (const auto& [other, inliers] : map.Neighbours(id)) ranked.emplace_back(-inliers, other);
  std::sort(ranked.begin(), ranked.end());
  std::vector<ImageId> neighbours;
  for (const auto& [inliers, other] : ranked) neighbours.push_back(other);
  return neighbours;
}

// At each angle, which is relaxed stepwise as the merger does.
bool StartFromBestPairOf(ImageId id, Submap* submap) {
  const std::vector<ImageId> neighbours = NeighboursMostInliersFirst(submap->map(), id);
  for (const double angle_deg : limits::kInitialAnglesDeg) {
    InitialPairOptions options;
    options.min_triangulation_angle_deg = angle_deg;
    for (const ImageId other : neighbours) {
      if (submap->Start(options, id, other, Ignore).status.ok()) return true;
    }
  }
  return false;
}

}  // namespace

std::unique_ptr<Submap> MapAnew(const Submap& submap, ImageId first) {
  SubmapOptions options = submap.options();
  options.background = false;
  std::unique_ptr<SceneMap> map = submap.map().Clone();
  map->Clear();
  auto anew = std::make_unique<Submap>(options, submap.local_adjustment(), std::move(map));
  if (!StartFromBestPairOf(first, anew.get())) return nullptr;
  for (const int64_t id : submap.waiting().held_elsewhere()) {
    if (!submap.map().IsRegistered(id)) anew->SetHeldElsewhere(id, true);
  }
  for (const ImageId id : submap.map().photos()) {
    const bool is_registered = submap.map().IsRegistered(id);
    if (is_registered || !submap.waiting().MatchesSimilarPlace(id)) anew->Enqueue(id);
  }
  anew->RefineUntilStable(Ignore);
  return anew;
}

int64_t CountAgreeingMatches(const SceneMap& map, double max_epipolar_error_px) {
  int64_t num_agreeing = 0;
  for (const ImageId id : map.reconstruction().RegImageIds()) {
    num_agreeing += EpipolarVotes(map, id, max_epipolar_error_px).agree;
  }
  return num_agreeing / 2;
}

}  // namespace skein
