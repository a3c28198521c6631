// guidance_policy: which photo to take next? From a pool of photos of a synthetic place each policy
// takes one after the other. How much of the true surface a dense matching of those taken covers is
// told over their number, as a share of what the whole pool covers. Beside it stands what guidance
// says of the place, and how much of that is false.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <iostream>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>

#include "benchmark/dense_cloud.h"
#include "benchmark/feedback_quality.h"
#include "benchmark/photo_pool.h"
#include "benchmark/point_grid.h"
#include "benchmark/told_quality.h"
#include "clients/sim/random.h"
#include "guidance/depth_grid.h"
#include "guidance/place_summary.h"
#include "guidance/stations.h"

namespace skein {
namespace {

using nlohmann::json;

constexpr double kDepthTolerance = 0.1;
constexpr int kFirstPhotos = 3;  // which every policy begins with, but for gaps
constexpr double kWantedShare = 0.9;

struct Arguments {
  PoolOptions pool;
  DenseOptions dense;
  std::string scenario = "together", table;
  std::vector<std::string> policies;
  bool gaps = false;  // begin with the walks, less the middle third of each
  int max_photos = 72;
  int every = 6;  // photos between two dense matchings
};

struct Capture {
  std::vector<int> taken, registered, left;
  PoolMap map;         // of the registered ones
  PlaceQuality place;  // of that map
  int failed = 0;      // that did not register when they were taken
};

// At one number of photos. Shares are of the surface that the whole pool's dense points cover.
struct Standing {
  int photos = 0;
  PlaceVerdict verdict = PlaceVerdict::kGrowing;
  double covered = 0;            // by the dense points of those taken
  double told_good = 0;          // by guidance
  double told_good_falsely = 0;  // and not covered
};

DepthGrid ViewOf(const PhotoPool& pool, const Surface& surface, int photo) {
  DepthGrid view(pool.camera(), pool.photo(photo).cam_from_world, surface.cell,
                 surface.working_distance);
  view.Draw(surface.surfels);
  return view;
}

bool Sees(const DepthGrid& view, const Eigen::Vector3d& centre, const Surfel& surfel) {
  return (centre - surfel.position).dot(surfel.normal) > 0 &&
         view.Look(surfel.position, kDepthTolerance) == DepthGrid::Sight::kSeen;
}

// The left photo with the highest score, among those that are predicted to share points with the
// map; as `skein` predicts it for stations.
class Scorer {
 public:
  Scorer(const PhotoPool& pool, const Capture& capture) : pool_(pool), capture_(capture) {}

  int Best(const std::function<double(int photo, const DepthGrid& view)>& score) const {
    int best = capture_.left.front();
    double highest = -std::numeric_limits<double>::infinity();
    for (const int photo : capture_.left) {
      const DepthGrid view = ViewOf(pool_, capture_.place.surface, photo);
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
};

using Utility =
    std::function<double(const QualityOptions&, const Surfel&, const std::vector<ViewOfSurfel>&)>;

// How near to good a surfel is with these photos, 0 to 1. The first two count a little, as no
// third one helps without them.
double UpToGood(const QualityOptions& options, const Surfel& surfel,
                const std::vector<ViewOfSurfel>& views) {
  const SurfelQuality quality = AssessSurfel(options, surfel.normal, views);
  if (quality.good) return 1;
  const double pairs = std::min(1.0, quality.reconstructability / options.min_reconstructability) *
                       std::min(1.0, options.max_sigma_gsd * options.target_gsd / quality.sigma);
  return 0.1 * std::min(quality.num_photos, 2) + 0.76 * pairs;
}

// Each photo adds less than the one before, and more where it makes the depth surer; good is not
// the end.
double Diminishing(const QualityOptions& options, const Surfel& surfel,
                   const std::vector<ViewOfSurfel>& views) {
  const SurfelQuality quality = AssessSurfel(options, surfel.normal, views);
  return 0.1 * std::min(quality.num_photos, 2) +
         0.8 * (1 - std::exp(-quality.reconstructability / 2)) *
             std::min(1.0, options.target_gsd / quality.sigma);
}

ViewOfSurfel ViewFrom(const PhotoPool& pool, const CameraPose& pose, const Surfel& surfel) {
  const Eigen::Vector3d ray = pose.Centre() - surfel.position;
  return {ray.normalized(), ray.norm() / pool.camera().FocalPx()};
}

// Area that becomes good or comes nearer to it, and what open borders promise.
int TakeByGain(const PhotoPool& pool, const Capture& capture, const Utility& utility_of) {
  QualityOptions options;
  options.target_gsd = capture.place.completeness.target_gsd;
  const std::vector<Surfel>& surfels = capture.place.surface.surfels;
  std::vector<std::vector<ViewOfSurfel>> views(surfels.size());
  std::vector<double> utility(surfels.size(), 1);
  for (size_t i = 0; i < surfels.size(); ++i) {
    for (const uint32_t photo : surfels[i].photos) {
      views[i].push_back(ViewFrom(pool, capture.map.map.photos[photo].cam_from_world, surfels[i]));
    }
    if (capture.place.surfels[i].counts) utility[i] = utility_of(options, surfels[i], views[i]);
  }
  return Scorer(pool, capture).Best([&](int photo, const DepthGrid& view) {
    const CameraPose& pose = pool.photo(photo).cam_from_world;
    const Eigen::Vector3d centre = pose.Centre();
    double gain = 0;
    for (size_t i = 0; i < surfels.size(); ++i) {
      if (surfels[i].open_border) {
        Surfel beyond = surfels[i];
        beyond.position = beyond.beyond;
        if (Sees(view, centre, beyond)) gain += 0.1 * 2 * beyond.area;
      }
      if (utility[i] >= 1 || !Sees(view, centre, surfels[i])) continue;
      std::vector<ViewOfSurfel> with = views[i];
      with.push_back(ViewFrom(pool, pose, surfels[i]));
      gain += surfels[i].area * std::max(0.0, utility_of(options, surfels[i], with) - utility[i]);
    }
    return gain;
  });
}

// The one that sees most of what has a low quality by On-the-fly Feedback SfM.
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

// Takes a new photo from the best station. Where guidance has none to give, the farthest one of the
// pool that overlaps.
class Follower {
 public:
  explicit Follower(PhotoPool* pool) : pool_(pool) {}

  int Take(const Capture& capture) {
    StationSeeker seeker;
    seeker.last_photo = static_cast<uint32_t>(capture.registered.size()) - 1;
    seeker.agent = capture.map.map.photos.back().agent;
    for (const auto& [photo, advised] : advised_) {
      const auto& registered = capture.registered;
      if (std::find(registered.begin(), registered.end(), photo) != registered.end()) continue;
      seeker.in_vain.push_back(advised);
    }
    const auto stations =
        ChooseStations({}, QualityOptions(), capture.map.map, capture.place, {seeker});
    if (stations[0].empty()) return TakeFarthestOverlapping(*pool_, capture);
    const Station& station = stations[0].front();
    const int photo = pool_->Add(station.cam_from_world, seeker.agent);
    advised_.emplace_back(photo, VainPhoto{station.cam_from_world, station.common_points});
    return photo;
  }

 private:
  PhotoPool* const pool_;
  std::vector<std::pair<int, VainPhoto>> advised_;  // photos of the pool
};

using Policy = std::function<int(const PhotoPool&, const Capture&)>;

// Of those that take a photo of the pool.
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

class Contest {
 public:
  explicit Contest(const Arguments& arguments) : arguments_(arguments), pool_(arguments.pool) {
    std::vector<int> all;
    for (int i = 0; i < pool_.size(); ++i) all.push_back(i);
    const PoolMap map = pool_.MapOf(pool_.Registered(all));
    const PlaceQuality place = AssessPlace({}, {}, map.map);
    tolerance_ = 2 * place.completeness.target_gsd;
    // The pool's own matching takes each photo's depth map once and is not asked for again.
    const std::vector<bool> covered =
        Covered(DenseCloud(arguments.dense, pool_).Make(map), std::vector<bool>());
    covered_by_all_ = covered;
    num_covered_by_all_ = std::count(covered.begin(), covered.end(), true);
    if (num_covered_by_all_ == 0) throw std::runtime_error("the whole pool covers nothing");
    if (!arguments.table.empty()) {
      table_.open(arguments.table);
      table_ << "scenario,seed,policy,photos,registered,failed,covered,verdict,told_good,"
                "told_good_falsely\n";
    }
  }

  void Execute() {
    for (const std::string& name : arguments_.policies) Run(name);
    table_.close();
    if (!arguments_.table.empty() && !table_) {
      throw std::runtime_error("cannot write " + arguments_.table);
    }
  }

 private:
  // Which true samples have a dense point near; of those in `among` where it is not empty.
  std::vector<bool> Covered(const std::vector<Eigen::Vector3d>& dense,
                            const std::vector<bool>& among) const {
    PointGrid grid(tolerance_);
    for (uint32_t i = 0; i < dense.size(); ++i) grid.Add(dense[i], i);
    std::vector<bool> covered;
    for (size_t i = 0; i < pool_.samples().size(); ++i) {
      covered.push_back((among.empty() || among[i]) &&
                        grid.AnyNear(pool_.samples()[i].xyz, tolerance_));
    }
    return covered;
  }

  // What every policy begins with.
  std::vector<int> FirstPhotos() const {
    std::vector<int> first;
    const int num_stations = arguments_.pool.scenario.agents * arguments_.pool.scenario.photos;
    for (int i = 0; i < (arguments_.gaps ? num_stations : kFirstPhotos); ++i) {
      const int third = 3 * (i % arguments_.pool.scenario.photos) / arguments_.pool.scenario.photos;
      if (!arguments_.gaps || third != 1) first.push_back(i);
    }
    return first;
  }

  static void Take(const PhotoPool& pool, int photo, Capture* capture) {
    capture->taken.push_back(photo);
    auto& left = capture->left;
    left.erase(std::remove(left.begin(), left.end(), photo), left.end());
    // In the order in which they register, so that the last one is where the camera is.
    capture->registered = pool.Registered(capture->taken);
    const auto& registered = capture->registered;
    capture->failed += std::find(registered.begin(), registered.end(), photo) == registered.end();
  }

  static PlaceVerdict VerdictOf(const Capture& capture) {
    return SummarisePlace({}, capture.place, capture.registered.size()).verdict;
  }

  Standing Measure(const Capture& capture, DenseCloud* dense) const {
    const std::vector<bool> covered = Covered(dense->Make(capture.map), covered_by_all_);
    const std::vector<Told> told = WhatIsTold(capture.place, pool_.samples());
    const double share = 1 / static_cast<double>(num_covered_by_all_);
    Standing standing;
    standing.photos = static_cast<int>(capture.taken.size());
    standing.verdict = VerdictOf(capture);
    for (size_t i = 0; i < told.size(); ++i) {
      if (!covered_by_all_[i]) continue;
      const bool is_good = told[i] == Told::kGood;
      standing.covered += covered[i] ? share : 0;
      standing.told_good += is_good ? share : 0;
      standing.told_good_falsely += is_good && !covered[i] ? share : 0;
    }
    return standing;
  }

  // What became of a policy. `first`: when each verdict was given, or a better one.
  struct Course {
    std::vector<Standing> curve;
    std::map<PlaceVerdict, Standing> first;
  };

  // Measures every so many photos, at the end, and where a verdict is given for the first time.
  void Follow(const std::string& name, const Capture& capture, bool is_last, DenseCloud* dense,
              Course* course) {
    const bool is_due = is_last || capture.taken.size() % arguments_.every == 0;
    const PlaceVerdict verdict = VerdictOf(capture);
    std::vector<PlaceVerdict> reached;
    for (const PlaceVerdict v : {PlaceVerdict::kNearly, PlaceVerdict::kComplete}) {
      if (verdict >= v && course->first.count(v) == 0) reached.push_back(v);
    }
    if (!is_due && reached.empty()) return;
    const Standing standing = Measure(capture, dense);
    for (const PlaceVerdict v : reached) course->first[v] = standing;
    if (is_due) course->curve.push_back(standing);
    Tell(name, capture, standing);
  }

  void Run(const std::string& name) {
    PhotoPool pool = pool_;
    DenseCloud dense(arguments_.dense, pool);
    Policy policy = PolicyNamed(name, arguments_.pool.scenario.seed);
    if (name == "advice") {
      policy = [follower = Follower(&pool)](const PhotoPool&, const Capture& capture) mutable {
        return follower.Take(capture);
      };
    }
    Capture capture;
    for (int i = 0; i < pool.size(); ++i) capture.left.push_back(i);
    for (const int photo : FirstPhotos()) Take(pool, photo, &capture);
    Course course;
    const size_t last = std::min(arguments_.max_photos, pool_.size());
    while (true) {
      capture.map = pool.MapOf(capture.registered);
      capture.place = AssessPlace({}, {}, capture.map.map);
      const bool is_last = capture.taken.size() >= last;
      Follow(name, capture, is_last, &dense, &course);
      if (is_last) break;
      Take(pool, policy(pool, capture), &capture);
    }
    Summarise(name, course, capture.failed);
  }

  void Tell(const std::string& name, const Capture& capture, const Standing& standing) {
    if (!table_.is_open()) return;
    table_ << arguments_.scenario << "," << arguments_.pool.scenario.seed << "," << name << ","
           << standing.photos << "," << capture.registered.size() << "," << capture.failed << ","
           << standing.covered << "," << static_cast<int>(standing.verdict) << ","
           << standing.told_good << "," << standing.told_good_falsely << std::endl;
  }

  // Photos to the wanted share, between two matchings by a straight line; null: not reached.
  static json PhotosTo(double wanted, const std::vector<Standing>& curve) {
    Standing before;
    for (const Standing& at : curve) {
      if (at.covered >= wanted) {
        return before.photos + (wanted - before.covered) / (at.covered - before.covered) *
                                   (at.photos - before.photos);
      }
      before = at;
    }
    return nullptr;
  }

  static json Of(const Standing& standing) {
    return {{"photos", standing.photos},
            {"verdict", static_cast<int>(standing.verdict)},
            {"covered", standing.covered},
            {"told_good", standing.told_good},
            {"told_good_falsely", standing.told_good_falsely},
            {"false_share_of_told",
             standing.told_good > 0 ? standing.told_good_falsely / standing.told_good : 0.0}};
  }

  void Summarise(const std::string& name, const Course& course, int failed) const {
    const auto& [curve, first] = course;
    const auto at_first = [&first = first](PlaceVerdict verdict) {
      const auto found = first.find(verdict);
      return found == first.end() ? json() : Of(found->second);
    };
    double area = 0;
    for (const Standing& at : curve) area += at.covered / static_cast<double>(curve.size());
    const json summary = {{"scenario", arguments_.scenario},
                          {"seed", arguments_.pool.scenario.seed},
                          {"policy", name},
                          {"pool", pool_.size()},
                          {"photos_to_70_percent", PhotosTo(0.7, curve)},
                          {"photos_to_90_percent", PhotosTo(kWantedShare, curve)},
                          {"area_under_curve", area},
                          {"last", curve.back().covered},
                          {"failed_to_register", failed},
                          {"nearly", at_first(PlaceVerdict::kNearly)},
                          {"complete", at_first(PlaceVerdict::kComplete)},
                          {"end", Of(curve.back())}};
    std::cout << summary.dump() << std::endl;
  }

  const Arguments arguments_;
  const PhotoPool pool_;
  double tolerance_ = 0;
  std::vector<bool> covered_by_all_;
  int64_t num_covered_by_all_ = 0;
  std::ofstream table_;
};

}  // namespace
}  // namespace skein

int main(int argc, char** argv) {
  skein::Arguments arguments;
  arguments.policies = skein::PolicyNames();
  arguments.pool.cache = "/tmp/skein-guidance";
  arguments.pool.width = 240;
  skein::sim::ScenarioOptions& scenario = arguments.pool.scenario;
  CLI::App app("Lets policies choose photos from a pool, one after the other");
  app.add_option("--scenario", arguments.scenario, "of skein sim")
      ->check(CLI::IsMember(skein::sim::ScenarioNames()))
      ->capture_default_str();
  app.add_option("--seed", scenario.seed, "of the place")->capture_default_str();
  app.add_option("--agents", scenario.agents, "walks")->capture_default_str();
  app.add_option("--photos", scenario.photos, "stations of a walk; each is taken in four ways")
      ->capture_default_str();
  app.add_option("--policies", arguments.policies, "who chooses")
      ->check(CLI::IsMember(skein::PolicyNames()));
  app.add_option("--max-photos", arguments.max_photos, "that are taken")->capture_default_str();
  app.add_option("--every", arguments.every, "photos between two dense matchings")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--width", arguments.pool.width, "of a photo; 4:3")
      ->check(CLI::Range(160, 1600))
      ->capture_default_str();
  app.add_option("--cache", arguments.pool.cache, "folder for rendered photos")
      ->capture_default_str();
  app.add_flag("--gaps", arguments.gaps, "Begin with the walks, less the middle third of each");
  app.add_option("--table", arguments.table, "file for a line of CSV a dense matching");
  app.add_option("--threads", arguments.pool.threads)->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  try {
    cv::setNumThreads(1);
    scenario.scenario = *skein::sim::ParseScenario(arguments.scenario);
    arguments.pool.height = arguments.pool.width * 3 / 4;
    arguments.dense.threads = arguments.pool.threads;
    skein::Contest(arguments).Execute();
    return 0;
  } catch (const std::exception& error) {
    std::cerr << "guidance_policy: " << error.what() << "\n";
    return 1;
  }
}
