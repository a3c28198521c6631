// What the guide's computation costs on a COLMAP model: CPU time of each part (of the surface once
// more by itself), for the whole model
// and, with --photos, for as many of its photos as came first (by their ids). Then the mean CPU
// time of an update (LivePlace) by a few photos more, over the next ones. In each a part of the
// points moves by up to seven times the median ground sampling distance, as bundle adjustment moves
// them: in a session 0.02 to 0.07. off: the good share in the end, less that of a map assessed
// afresh.
//
//   guide_cost --model SPARSE_DIR [--photos N,N...] [--agents 1] [--updates 20] [--step 1]
//              [--moving 0.03]
//
// Agents take turns: photo i is of agent i mod N. Points seen by less than two of the photos are
// left out. Textures are not known, so all surface has texture.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <exception>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "core/process.h"
#include "guidance/live_place.h"
#include "guidance/model_map.h"
#include "guidance/quality.h"
#include "guidance/stations.h"
#include "guidance/surface.h"
#include "sfm/model_files.h"

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
    if (point.photos.size() < 2) point.photos.clear();
    part.points.push_back(std::move(point));
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

std::vector<StationSeeker> SeekersOf(const GuidedMap& map, int agents) {
  std::vector<StationSeeker> seekers;
  for (int agent = 0; agent < std::min(agents, static_cast<int>(map.photos.size())); ++agent) {
    seekers.push_back({agent, static_cast<uint32_t>(map.photos.size() - 1 - agent), {}, {}});
  }
  return seekers;
}

struct Updates {
  size_t num = 20, step = 1;  // photos
  double moving = 0.03;       // part of the points
};

// Mean CPU seconds of an update.
struct UpdateCost {
  double place_s = 0, stations_s = 0;
  double off = 0;  // the good share in the end, less that of a map assessed afresh
};

void MovePoints(double share, double by, std::mt19937_64* random, GuidedMap* map) {
  std::uniform_real_distribution<double> unit(0, 1);
  for (GuidedPoint& point : map->points) {
    if (unit(*random) >= share) continue;
    for (int axis = 0; axis < 3; ++axis) point.xyz[axis] += by * (2 * unit(*random) - 1);
  }
}

UpdateCost MeasureUpdates(GuidedMap map, size_t count, const Updates& updates, int agents) {
  LivePlace live;
  const size_t num_photos = updates.num * updates.step;
  const size_t begin = std::min(count, map.photos.size() - num_photos);
  const double gsd = live.Update(FirstPhotos(map, begin, agents), 0).surface.median_gsd;
  std::mt19937_64 random(1);
  UpdateCost sum;
  double good_share = 0;
  for (size_t i = 1; i <= updates.num; ++i) {
    MovePoints(updates.moving, 7 * gsd, &random, &map);
    const GuidedMap now = FirstPhotos(map, begin + i * updates.step, agents);
    Lap lap;
    const PlaceQuality& place = live.Update(now, 0);
    sum.place_s += lap.Take();
    good_share = place.completeness.good_share;
    ChooseStations(live.map(), place, SeekersOf(now, agents));
    sum.stations_s += lap.Take();
  }
  const auto n = static_cast<double>(updates.num);
  const GuidedMap last = FirstPhotos(map, begin + num_photos, agents);
  const double off = good_share - AssessPlace(last).completeness.good_share;
  return {sum.place_s / n, sum.stations_s / n, off};
}

void PrintRow(const GuidedMap& all, size_t count, const Updates& updates, int agents) {
  const GuidedMap map = FirstPhotos(all, count, agents);
  Lap lap;
  const DetailedSurface surface = MakeSurface(map);
  const double surface_s = lap.Take();
  const PlaceQuality place = AssessPlace(map);
  const double place_s = lap.Take();
  ChooseStations(map, place, SeekersOf(map, agents));
  const double stations_s = lap.Take();
  const auto num_points = std::count_if(map.points.begin(), map.points.end(),
                                        [](const GuidedPoint& p) { return !p.photos.empty(); });
  const UpdateCost update = MeasureUpdates(all, count, updates, agents);
  std::printf(
      "| %zu | %td | %zu | %zu | %.3f | %.3f | %.3f | %.3f | %.3f | %.3f | %.3f | %.3f | %+.3f |\n",
      map.photos.size(), num_points, surface.surface.surfels.size(), surface.parts.size(),
      place.completeness.good_share, place_s, surface_s, stations_s, place_s + stations_s,
      update.place_s, update.stations_s, update.place_s + update.stations_s, update.off);
}

int Main(int argc, char** argv) {
  CLI::App app("What the guide's computation costs");
  std::string folder;
  std::vector<size_t> counts;
  int agents = 1;
  Updates updates;
  app.add_option("--model", folder, "COLMAP model")->required()->check(CLI::ExistingDirectory);
  app.add_option("--photos", counts, "Of its first N photos")
      ->delimiter(',')
      ->check(CLI::PositiveNumber);
  app.add_option("--agents", agents, "That ask for stations")->check(CLI::Range(1, 100));
  app.add_option("--updates", updates.num, "How many")->check(CLI::Range(1, 1000));
  app.add_option("--step", updates.step, "Photos an update")->check(CLI::Range(1, 100));
  app.add_option("--moving", updates.moving, "Part of the points")->check(CLI::Range(0.0, 1.0));
  CLI11_PARSE(app, argc, argv);
  const Result<Reconstruction> model = ReadModelFiles(folder);
  if (!model) throw std::runtime_error(model.error());
  const GuidedMap map = MapOfModel(*model, size_t{1} << 30);
  counts.push_back(map.photos.size());
  std::printf(
      "| photos | points | surfels | parts | good | place s | of which surface s | stations s | "
      "all s | update: place s | stations s | all s | off |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  updates.num = std::min(updates.num, map.photos.size() / updates.step);
  for (const size_t count : counts) {
    PrintRow(map, std::min(count, map.photos.size()), updates, agents);
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
