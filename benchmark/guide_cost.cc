// What the guide's computation costs on a COLMAP model: CPU time of each part (of the surface once
// more by itself), for the whole model
// and, with --photos, for as many of its photos as came first (by their ids).
//
//   guide_cost --model SPARSE_DIR [--photos N,N...] [--agents 1]
//
// Agents take turns: photo i is of agent i mod N. Points seen by less than two of the photos are
// left out. Textures are not known, so all surface has texture.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <exception>
#include <string>
#include <utility>
#include <vector>

#include "base/reconstruction.h"
#include "core/process.h"
#include "guidance/model_map.h"
#include "guidance/quality.h"
#include "guidance/stations.h"
#include "guidance/surface.h"

namespace skein {
namespace {

GuidedMap FirstPhotos(const GuidedMap& map, size_t count, int agents) {
  GuidedMap part;
  part.cameras = map.cameras;
  part.photos.assign(map.photos.begin(), map.photos.begin() + static_cast<ptrdiff_t>(count));
  for (size_t i = 0; i < count; ++i) part.photos[i].agent = static_cast<int>(i) % agents;
  for (GuidedPoint point : map.points) {
    point.photos.erase(std::remove_if(point.photos.begin(), point.photos.end(),
                                      [&](uint32_t photo) { return photo >= count; }),
                       point.photos.end());
    if (point.photos.size() >= 2) part.points.push_back(std::move(point));
  }
  return part;
}

// CPU seconds of the process since the last call.
class Lap {
 public:
  double Take() {
    const double now = CpuTimeS();
    return now - std::exchange(last_, now);
  }

 private:
  double last_ = CpuTimeS();
};

void PrintRow(const GuidedMap& map, int agents) {
  Lap lap;
  const DetailedSurface surface = MakeSurface({}, map);
  const double surface_s = lap.Take();
  const PlaceQuality place = AssessPlace({}, {}, map);
  const double place_s = lap.Take();
  QualityOptions quality;
  quality.target_gsd = place.completeness.target_gsd;
  std::vector<StationSeeker> seekers;
  for (int agent = 0; agent < std::min(agents, static_cast<int>(map.photos.size())); ++agent) {
    seekers.push_back({agent, static_cast<uint32_t>(map.photos.size() - 1 - agent), {}, {}});
  }
  lap.Take();
  ChooseStations({}, quality, map, place, seekers);
  const double stations_s = lap.Take();
  std::printf("| %zu | %zu | %zu | %zu | %.3f | %.3f | %.3f | %.3f | %.3f |\n", map.photos.size(),
              map.points.size(), surface.surface.surfels.size(), surface.parts.size(),
              place.completeness.good_share, place_s, surface_s, stations_s, place_s + stations_s);
}

int Main(int argc, char** argv) {
  CLI::App app("What the guide's computation costs");
  std::string folder;
  std::vector<size_t> counts;
  int agents = 1;
  app.add_option("--model", folder, "COLMAP model")->required()->check(CLI::ExistingDirectory);
  app.add_option("--photos", counts, "Of its first N photos")
      ->delimiter(',')
      ->check(CLI::PositiveNumber);
  app.add_option("--agents", agents, "That ask for stations")->check(CLI::Range(1, 100));
  CLI11_PARSE(app, argc, argv);
  colmap::Reconstruction model;
  model.Read(folder);
  const GuidedMap map = MapOfModel(model, size_t{1} << 30);
  counts.push_back(map.photos.size());
  std::printf(
      "| photos | points | surfels | parts | good | place s | of which surface s | stations s | "
      "all s |\n|---|---|---|---|---|---|---|---|---|\n");
  for (const size_t count : counts) {
    PrintRow(FirstPhotos(map, std::min(count, map.photos.size()), agents), agents);
  }
  return 0;
}

}  // namespace
}  // namespace skein

int main(int argc, char** argv) {
  try {
    return skein::Main(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "guide_cost: %s\n", error.what());
    return 1;
  }
}
