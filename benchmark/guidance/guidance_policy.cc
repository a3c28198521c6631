// guidance_policy: which photo to take next? From a pool of photos of a synthetic place, or of a
// real one, each policy takes one after the other. How much of the surface a dense matching of
// those taken covers is told over their number, as a share of what the whole pool covers. Beside it
// stands what guidance says of the place, and how much of that is false.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <fstream>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>

#include "benchmark/guidance/photo_policies.h"
#include "benchmark/guidance/told_quality.h"
#include "benchmark/support/dense_cloud.h"
#include "benchmark/support/model_pool.h"
#include "benchmark/support/point_grid.h"
#include "benchmark/support/synthetic_pool.h"
#include "core/statistics.h"
#include "guidance/place_summary.h"

namespace skein {
namespace {

using nlohmann::json;

constexpr int kFirstPhotos = 3;  // which every policy begins with, but for gaps
constexpr double kWantedShare = 0.9;

struct Arguments {
  SyntheticPoolOptions synthetic;
  ModelPoolOptions model;  // taken where it names a model
  int threads = 1;
  std::string name, scenario = "together", table;
  std::vector<std::string> policies;
  bool gaps = false;  // begin with the walks, less the middle third of each
  int max_photos = 72;
  int every = 6;  // photos between two dense matchings
};

// At one number of photos. Shares are of Contest::samples_.
struct Standing {
  int photos = 0;
  PlaceVerdict verdict = PlaceVerdict::kGrowing;
  Completeness completeness;     // as it is told
  double covered = 0;            // by the dense points of those taken
  double covered_ground = 0;     // the same of the ground, which does not count
  double told_good = 0;          // by guidance
  double told_good_falsely = 0;  // and not covered
};

class Contest {
 public:
  explicit Contest(const Arguments& arguments) : arguments_(arguments) {
    if (arguments.model.model.empty()) {
      synthetic_.emplace(arguments.synthetic);
    } else {
      model_.emplace(arguments.model);
    }
    std::vector<int> all;
    for (int i = 0; i < pool().size(); ++i) all.push_back(i);
    const PoolMap map = pool().MapOf(pool().Registered(all));
    const PlaceQuality place = AssessPlace(map.map);
    tolerance_ = 2 * place.completeness.target_gsd;
    // The pool's own matching takes each photo's depth map once and is not asked for again.
    const std::vector<Eigen::Vector3d> dense = DenseCloud(pool(), arguments.threads).Make(map);
    TakeSamples(map, place, synthetic_ ? synthetic_->samples() : SamplesOf(dense, place), dense);
    if (samples_.empty()) throw std::runtime_error("the whole pool covers nothing");
    TellOfPool(map, dense.size());
    if (!arguments.table.empty()) {
      table_.open(arguments.table);
      table_ << "scenario,seed,policy,photos,registered,failed,covered,verdict,told_good,"
                "told_good_falsely,good_share,hole_share,open_share,covered_ground\n";
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
  const PhotoPool& pool() const {
    if (model_) return *model_;
    return *synthetic_;
  }

  // Where no true surface is known. As far apart as those of a synthetic pool.
  static std::vector<SurfaceSample> SamplesOf(const std::vector<Eigen::Vector3d>& dense,
                                              const PlaceQuality& place) {
    constexpr double kSpacingPx = 6;
    std::vector<SurfaceSample> samples;
    for (const Eigen::Vector3d& xyz : dense) samples.push_back({xyz});
    return ThinOut(samples, kSpacingPx * place.surface.median_gsd);
  }

  void TellOfPool(const PoolMap& map, size_t num_dense) const {
    std::cerr << arguments_.name << ": " << pool().size() << " photos, " << map.taken.size()
              << " in one map of " << map.map.points.size() << " points; " << num_dense
              << " dense points near " << samples_.size() << " samples of the surface and "
              << ground_.size() << " of the ground\n";
    if (!model_) return;
    std::cerr << arguments_.name << ": the model has " << model_->num_points() << " points; "
              << model_->num_left_out()
              << " observations outside of the photos without distortion are left out\n";
  }

  // What the whole pool covers and what of it counts, or is ground.
  void TakeSamples(const PoolMap& map, const PlaceQuality& place,
                   const std::vector<SurfaceSample>& all,
                   const std::vector<Eigen::Vector3d>& dense) {
    const std::vector<bool> ground = AreGround(map.map, place, all), covered = Covered(dense, all);
    for (size_t i = 0; i < all.size(); ++i) {
      if (!covered[i] || !pool().Counts(map.taken, all[i], place.completeness.max_gsd)) continue;
      (ground[i] ? ground_ : samples_).push_back(all[i]);
    }
  }

  // Which samples have a dense point near.
  std::vector<bool> Covered(const std::vector<Eigen::Vector3d>& dense,
                            const std::vector<SurfaceSample>& samples) const {
    PointGrid grid(tolerance_);
    for (uint32_t i = 0; i < dense.size(); ++i) grid.Add(dense[i], i);
    std::vector<bool> covered;
    for (const SurfaceSample& sample : samples) {
      covered.push_back(grid.AnyNear(sample.xyz, tolerance_));
    }
    return covered;
  }

  // What every policy begins with.
  std::vector<int> FirstPhotos() const {
    std::vector<int> first;
    const int num_stations =
        arguments_.synthetic.scenario.agents * arguments_.synthetic.scenario.photos;
    for (int i = 0; i < (arguments_.gaps ? num_stations : kFirstPhotos); ++i) {
      const int third =
          3 * (i % arguments_.synthetic.scenario.photos) / arguments_.synthetic.scenario.photos;
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
    return SummarisePlace(capture.place, capture.registered.size()).verdict;
  }

  Standing Measure(const Capture& capture, DenseCloud* dense) const {
    const std::vector<Eigen::Vector3d> points = dense->Make(capture.map);
    const std::vector<bool> covered = Covered(points, samples_);
    const std::vector<Told> told = WhatIsTold(capture.place, samples_);
    std::vector<bool> good, falsely;
    for (size_t i = 0; i < told.size(); ++i) {
      good.push_back(told[i] == Told::kGood);
      falsely.push_back(good[i] && !covered[i]);
    }
    return {static_cast<int>(capture.taken.size()),
            VerdictOf(capture),
            capture.place.completeness,
            ShareOf(covered),
            ShareOf(Covered(points, ground_)),
            ShareOf(good),
            ShareOf(falsely)};
  }

  static double ShareOf(const std::vector<bool>& of) {
    if (of.empty()) return 0;
    const auto count = std::count(of.begin(), of.end(), true);
    return static_cast<double>(count) / static_cast<double>(of.size());
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
    std::optional<SyntheticPool> own;  // that viewpoints are photographed into
    std::optional<Follower> follower;
    if (name == "advice" && synthetic_) {
      own = synthetic_;
      follower.emplace(*own, [&](const Capture&, const Station& station, int agent) {
        return own->Add(station.cam_from_world, agent);
      });
    } else if (name == "advice") {
      follower.emplace(pool(), [&](const Capture& capture, const Station& station, int) {
        return NearestLeft(pool(), capture, station);
      });
    }
    const PhotoPool& pool = own ? *own : this->pool();
    DenseCloud dense(pool, arguments_.threads);
    const Policy policy = PolicyNamed(name, arguments_.synthetic.scenario.seed);
    Capture capture;
    for (int i = 0; i < pool.size(); ++i) capture.left.push_back(i);
    for (const int photo : FirstPhotos()) Take(pool, photo, &capture);
    Course course;
    const size_t last = std::min(arguments_.max_photos, this->pool().size());
    while (true) {
      capture.map = pool.MapOf(capture.registered);
      capture.place = AssessPlace(capture.map.map);
      const bool is_last = capture.taken.size() >= last;
      Follow(name, capture, is_last, &dense, &course);
      if (is_last) break;
      Take(pool, follower ? follower->Take(capture) : policy(pool, capture), &capture);
    }
    Summarise(name, course, capture.failed, follower ? Of(*follower) : json());
  }

  void Tell(const std::string& name, const Capture& capture, const Standing& standing) {
    if (!table_.is_open()) return;
    table_ << arguments_.name << "," << arguments_.synthetic.scenario.seed << "," << name << ","
           << standing.photos << "," << capture.registered.size() << "," << capture.failed << ","
           << standing.covered << "," << static_cast<int>(standing.verdict) << ","
           << standing.told_good << "," << standing.told_good_falsely << ","
           << standing.completeness.good_share << "," << standing.completeness.hole_share << ","
           << standing.completeness.open_share << "," << standing.covered_ground << std::endl;
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
            {"good_share", standing.completeness.good_share},
            {"hole_share", standing.completeness.hole_share},
            {"open_share", standing.completeness.open_share},
            {"covered", standing.covered},
            {"covered_ground", standing.covered_ground},
            {"told_good", standing.told_good},
            {"told_good_falsely", standing.told_good_falsely},
            {"false_share_of_told",
             standing.told_good > 0 ? standing.told_good_falsely / standing.told_good : 0.0}};
  }

  static json Of(const Follower& follower) {
    const std::vector<double>& away = follower.from_station();
    return {{"stations", away.size()},
            {"without_station", follower.without_station()},
            {"median_from_station", away.empty() ? json() : json(percentile(away, 50))}};
  }

  void Summarise(const std::string& name, const Course& course, int failed,
                 const json& advice) const {
    const auto& [curve, first] = course;
    const auto at_first = [&first = first](PlaceVerdict verdict) {
      const auto found = first.find(verdict);
      return found == first.end() ? json() : Of(found->second);
    };
    double area = 0;
    for (const Standing& at : curve) area += at.covered / static_cast<double>(curve.size());
    const json summary = {{"scenario", arguments_.name},
                          {"seed", arguments_.synthetic.scenario.seed},
                          {"policy", name},
                          {"pool", pool().size()},
                          {"photos_to_70_percent", PhotosTo(0.7, curve)},
                          {"photos_to_90_percent", PhotosTo(kWantedShare, curve)},
                          {"area_under_curve", area},
                          {"last", curve.back().covered},
                          {"failed_to_register", failed},
                          {"nearly", at_first(PlaceVerdict::kNearly)},
                          {"complete", at_first(PlaceVerdict::kComplete)},
                          {"end", Of(curve.back())},
                          {"advice", advice}};
    std::cout << summary.dump() << std::endl;
  }

  const Arguments arguments_;
  std::optional<SyntheticPool> synthetic_;  // or else:
  std::optional<ModelPool> model_;
  // That coverage is counted on: what counts in the pool, and its dense points cover.
  std::vector<SurfaceSample> samples_;
  std::vector<SurfaceSample> ground_;  // what would count, were it no ground
  double tolerance_ = 0;
  std::ofstream table_;
};

}  // namespace
}  // namespace skein

int main(int argc, char** argv) {
  skein::Arguments arguments;
  arguments.policies = skein::PolicyNames();
  arguments.synthetic.cache = "/tmp/skein-guidance";
  int width = 0;
  skein::sim::ScenarioOptions& scenario = arguments.synthetic.scenario;
  CLI::App app("Lets policies choose photos from a pool, one after the other");
  auto* const scenario_option = app.add_option("--scenario", arguments.scenario, "of skein sim")
                                    ->check(CLI::IsMember(skein::sim::ScenarioNames()))
                                    ->capture_default_str();
  app.add_option("--seed", scenario.seed, "of the place, and of what is random")
      ->capture_default_str();
  auto* const agents_option =
      app.add_option("--agents", scenario.agents, "walks")->capture_default_str();
  auto* const photos_option =
      app.add_option("--photos", scenario.photos, "stations of a walk; each is taken in four ways")
          ->capture_default_str();
  auto* const gaps_option =
      app.add_flag("--gaps", arguments.gaps, "Begin with the walks, less the middle third of each");
  auto* const cache_option =
      app.add_option("--cache", arguments.synthetic.cache, "folder for rendered photos")
          ->capture_default_str();
  auto* const model_option =
      app.add_option("--model", arguments.model.model,
                     "real photos instead of a scenario: the COLMAP model of all of them")
          ->check(CLI::ExistingDirectory);
  auto* const images_option =
      app.add_option("--images", arguments.model.images, "folder with the model's photos")
          ->check(CLI::ExistingDirectory);
  model_option->needs(images_option);
  images_option->needs(model_option);
  for (auto* const option :
       {scenario_option, agents_option, photos_option, gaps_option, cache_option}) {
    model_option->excludes(option);
  }
  app.add_option("--name", arguments.name,
                 "of the pool in what is told (default: the scenario, or the model's folder)");
  app.add_option("--policies", arguments.policies, "who chooses")
      ->check(CLI::IsMember(skein::PolicyNames()));
  app.add_option("--max-photos", arguments.max_photos, "that are taken")->capture_default_str();
  app.add_option("--every", arguments.every, "photos between two dense matchings")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--width", width, "of a photo (default: 240, 4:3; of real ones 400)")
      ->check(CLI::Range(160, 1600));
  app.add_option("--table", arguments.table, "file for a line of CSV a dense matching");
  app.add_option("--threads", arguments.threads)->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  try {
    cv::setNumThreads(1);
    const bool is_real = !arguments.model.model.empty();
    scenario.scenario = *skein::sim::ParseScenario(arguments.scenario);
    if (arguments.name.empty()) {
      arguments.name = is_real ? arguments.model.model : arguments.scenario;
    }
    arguments.synthetic.width = width > 0 ? width : 240;
    arguments.synthetic.height = arguments.synthetic.width * 3 / 4;
    if (width > 0) arguments.model.width = width;
    arguments.synthetic.threads = arguments.model.threads = arguments.threads;
    skein::Contest(arguments).Execute();
    return 0;
  } catch (const std::exception& error) {
    std::cerr << "guidance_policy: " << error.what() << "\n";
    return 1;
  }
}
