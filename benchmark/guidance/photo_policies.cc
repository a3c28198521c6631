#include "benchmark/guidance/photo_policies.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "benchmark/guidance/feedback_quality.h"
#include "clients/places/random.h"
#include "guidance/depth_grid.h"
#include "guidance/surfel_views.h"

namespace skein {
namespace {

constexpr double kViewTolerance = 0.1;  // of the depth

bool Sees(const DepthGrid& view, const Eigen::Vector3d& centre, const Surfel& surfel) {
  return (centre - surfel.position).dot(surfel.normal) > 0 &&
         view.Look(surfel.position, kViewTolerance) == DepthGrid::Sight::kSeen;
}

// Finds the remaining photo with the highest score among those that are predicted to share points
// with the map. The prediction is that of `skein` for viewpoints.
class Scorer {
 public:
  Scorer(const PhotoPool& pool, const Capture& capture)
      : pool_(pool), capture_(capture), positions_(PositionsOf(capture.place.surface.surfels)) {}

  int Best(const std::function<double(int photo, const DepthGrid& view)>& score) const {
    int best = capture_.left.front();
    double highest = -std::numeric_limits<double>::infinity();
    for (const int photo : capture_.left) {
      const DepthGrid view = ViewOf(photo);
      const double s = score(photo, view) - (PredictedCommon(photo, view) < kMinCommon ? 1e9 : 0);
      if (s > highest) {
        highest = s;
        best = photo;
      }
    }
    return best;
  }

 private:
  static constexpr double kMinCommon = 100, kMatchRate = 0.3;

  DepthGrid ViewOf(int photo) const {
    const Surface& surface = capture_.place.surface;
    DepthGrid view(pool_.camera(photo), pool_.photo(photo).cam_from_world, surface.cell,
                   surface.working_distance);
    view.Draw(positions_);
    return view;
  }

  double PredictedCommon(int photo, const DepthGrid& view) const {
    constexpr double kMinCos = 0.8660254037844387;  // 30 degrees
    const Eigen::Vector3d centre = pool_.photo(photo).cam_from_world.Centre();
    double points = 0;
    for (const Surfel& surfel : capture_.place.surface.surfels) {
      if (!Sees(view, centre, surfel)) continue;
      const Eigen::Vector3d ray = (centre - surfel.position).normalized();
      const bool known =
          std::any_of(surfel.photos.begin(), surfel.photos.end(), [&](uint32_t other) {
            const Eigen::Vector3d from =
                capture_.map.map.photos[other].cam_from_world.Centre() - surfel.position;
            return from.normalized().dot(ray) > kMinCos;
          });
      if (known) points += surfel.num_points;
    }
    return kMatchRate * points;
  }

  const PhotoPool& pool_;
  const Capture& capture_;
  const Eigen::Matrix3Xf positions_;  // of the surfels
};

using Utility =
    std::function<double(double target_gsd, const Surfel&, const std::vector<ViewOfSurfel>&)>;

// Progress of a surfel towards `good`, 0 to 1. Each of the first two photos adds 0.1, because a
// third one helps only with them.
double UpToGood(double target_gsd, const Surfel& surfel, const std::vector<ViewOfSurfel>& views) {
  const SurfelQuality quality = AssessSurfel(target_gsd, surfel.normal, views);
  if (quality.good) return 1;
  const double pairs = std::min(1.0, quality.reconstructability / kMinReconstructability) *
                       std::min(1.0, kMaxSigmaGsd * target_gsd / quality.sigma);
  return 0.1 * std::min(quality.num_photos, 2) + 0.76 * pairs;
}

// Utility with diminishing returns: each photo adds less than the one before, and more if it lowers
// the standard deviation of the depth. A surfel that is good can still gain.
double Diminishing(double target_gsd, const Surfel& surfel,
                   const std::vector<ViewOfSurfel>& views) {
  const SurfelQuality quality = AssessSurfel(target_gsd, surfel.normal, views);
  return 0.1 * std::min(quality.num_photos, 2) +
         0.8 * (1 - std::exp(-quality.reconstructability / 2)) *
             std::min(1.0, target_gsd / quality.sigma);
}

// Takes the photo with the largest gain: sum over surfels of area * (rise of utility), and the
// expected gain at frontiers.
int TakeByGain(const PhotoPool& pool, const Capture& capture, const Utility& utility_of) {
  const double target_gsd = capture.place.completeness.target_gsd;
  const GuidedMap& map = capture.map.map;
  const std::vector<Surfel>& surfels = capture.place.surface.surfels;
  std::vector<std::vector<ViewOfSurfel>> views(surfels.size());
  std::vector<double> utility(surfels.size(), 1);
  for (size_t i = 0; i < surfels.size(); ++i) {
    views[i] = ViewsOf(map, surfels[i]);
    if (capture.place.Counts(i)) utility[i] = utility_of(target_gsd, surfels[i], views[i]);
  }
  return Scorer(pool, capture).Best([&](int photo, const DepthGrid& view) {
    const Eigen::Vector3d centre = pool.photo(photo).cam_from_world.Centre();
    double gain = 0;
    for (size_t i = 0; i < surfels.size(); ++i) {
      if (surfels[i].open_border) {
        Surfel beyond = surfels[i];
        beyond.position = beyond.beyond;
        if (Sees(view, centre, beyond)) gain += 0.1 * 2 * beyond.area;
      }
      if (utility[i] >= 1 || !Sees(view, centre, surfels[i])) continue;
      std::vector<ViewOfSurfel> with = views[i];
      with.push_back(ViewFrom(centre, pool.camera(photo).FocalPx(), surfels[i].position));
      gain +=
          surfels[i].area * std::max(0.0, utility_of(target_gsd, surfels[i], with) - utility[i]);
    }
    return gain;
  });
}

// Takes the photo that sees most surface of low quality, as On-the-fly Feedback SfM measures it.
int TakeByFeedback(const PhotoPool& pool, const Capture& capture) {
  const std::vector<double> q = FeedbackQuality(TracksAround(capture.map, capture.place.surface));
  const std::vector<Surfel>& surfels = capture.place.surface.surfels;
  return Scorer(pool, capture).Best([&](int photo, const DepthGrid& view) {
    const Eigen::Vector3d centre = pool.photo(photo).cam_from_world.Centre();
    double lacking = 0;
    for (size_t i = 0; i < surfels.size(); ++i) {
      if (Sees(view, centre, surfels[i])) lacking += surfels[i].area * (1 - q[i]);
    }
    return lacking;
  });
}

double FromTaken(const PhotoPool& pool, const Capture& capture, int photo) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const int other : capture.taken) {
    nearest =
        std::min(nearest, HowFar(pool.photo(photo).cam_from_world, pool.photo(other).cam_from_world,
                                 capture.place.surface.working_distance));
  }
  return nearest;
}

int TakeFarthest(const PhotoPool& pool, const Capture& capture) {
  return *std::max_element(capture.left.begin(), capture.left.end(), [&](int a, int b) {
    return FromTaken(pool, capture, a) < FromTaken(pool, capture, b);
  });
}

int TakeFarthestOverlapping(const PhotoPool& pool, const Capture& capture) {
  return Scorer(pool, capture).Best([&](int photo, const DepthGrid&) {
    return FromTaken(pool, capture, photo);
  });
}

// Distance of a photo from a viewpoint: position in units of the viewpoint's distance to its
// target, and direction in radians.
double FromStation(const Station& station, const GuidedPhoto& photo) {
  const double distance = (station.cam_from_world.Centre() - station.target).norm();
  return HowFar(station.cam_from_world, photo.cam_from_world, distance);
}

}  // namespace

int NearestLeft(const PhotoPool& pool, const Capture& capture, const Station& station) {
  const auto distance = [&](int photo) { return FromStation(station, pool.photo(photo)); };
  return *std::min_element(capture.left.begin(), capture.left.end(),
                           [&](int a, int b) { return distance(a) < distance(b); });
}

int Follower::Take(const Capture& capture) {
  StationSeeker seeker;
  seeker.last_photo = static_cast<uint32_t>(capture.registered.size()) - 1;
  seeker.agent = capture.map.map.photos.back().agent;
  for (const auto& [photo, advised] : advised_) {
    const auto& registered = capture.registered;
    if (std::find(registered.begin(), registered.end(), photo) != registered.end()) continue;
    seeker.in_vain.push_back(advised);
  }
  const auto stations = ChooseStations(capture.map.map, capture.place, {seeker});
  if (stations[0].empty()) {
    ++without_station_;
    return TakeFarthestOverlapping(pool_, capture);
  }
  const Station& station = stations[0].front();
  const int photo = photograph_(capture, station, seeker.agent);
  advised_.emplace_back(photo, VainPhoto{station.cam_from_world, station.common_points});
  from_station_.push_back(FromStation(station, pool_.photo(photo)));
  return photo;
}

Policy PolicyNamed(const std::string& name, uint64_t seed) {
  if (name == "gain" || name == "gain-diminishing") {
    const Utility utility = name == "gain" ? UpToGood : Diminishing;
    return [utility](const PhotoPool& pool, const Capture& capture) {
      return TakeByGain(pool, capture, utility);
    };
  }
  if (name == "Q") return TakeByFeedback;
  if (name == "farthest") return TakeFarthest;
  if (name == "farthest-overlapping") return TakeFarthestOverlapping;
  if (name == "order") {
    return [](const PhotoPool&, const Capture& capture) { return capture.left.front(); };
  }
  return [random = sim::Random(seed ^ 0x706f6c69ULL)](const PhotoPool&,
                                                      const Capture& capture) mutable {
    return capture.left[random.Int(0, static_cast<int>(capture.left.size()) - 1)];
  };
}

const std::vector<std::string>& PolicyNames() {
  static const std::vector<std::string> names = {
      "advice", "gain",   "gain-diminishing", "Q",
      "order",  "random", "farthest",         "farthest-overlapping"};
  return names;
}

}  // namespace skein
