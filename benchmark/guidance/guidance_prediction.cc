// guidance_prediction: is the quality that guidance predicts for a place true? Some photos of a
// synthetic place are taken, unevenly. What guidance says of each surfel of their map is held
// against what a dense matching of the same photos makes of the true surface there.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <limits>
#include <nlohmann/json.hpp>
#include <numeric>

#include "benchmark/guidance/feedback_quality.h"
#include "benchmark/guidance/rank_correlation.h"
#include "benchmark/guidance/told_quality.h"
#include "benchmark/support/dense_cloud.h"
#include "benchmark/support/point_grid.h"
#include "benchmark/support/surface_distance.h"
#include "benchmark/support/synthetic_pool.h"
#include "clients/places/random.h"
#include "clients/places/truth.h"
#include "core/statistics.h"
#include "guidance/place_summary.h"
#include "testing/test_folder.h"

namespace skein {
namespace {

using nlohmann::json;

struct Arguments {
  SyntheticPoolOptions pool;
  std::string scenario = "together", table, calibration;
  double share = 0.25;  // of the pool that is taken, about; 7: all of it
};

constexpr size_t kMaxErrors = 80;          // dense points of a surfel that are measured
constexpr size_t kMinPoints = 5;           // dense points that an error needs
constexpr size_t kMinSamples = 5;          // true samples that a completeness needs
constexpr double kTrueErrorGsd = 2;        // a place is well reconstructed up to this error
constexpr double kTrueCompleteness = 0.8;  // and from this completeness on

// Some walks are dense in one part and thin in another, so that all qualities are there.
std::vector<int> TakeUnevenly(const PhotoPool& pool, double share, uint64_t seed) {
  const sim::Random base(seed ^ 0x756e6576ULL);
  std::vector<int> taken;
  for (int i = 0; i < pool.size(); ++i) {
    sim::Random of_walk = base.Fork(pool.photo(i).agent), of_photo = base.Fork(100000 + i);
    const double phase = of_walk.Uniform(0, 2 * M_PI), period = of_walk.Uniform(9, 18);
    const double wave = 0.5 + 0.5 * std::sin(2 * M_PI * i / period + phase);
    if (of_photo.Chance(share * (0.15 + 2.25 * wave * wave))) taken.push_back(i);
  }
  return taken;
}

// Of those taken, the largest set that comes together as one map.
std::vector<int> LargestMap(const PhotoPool& pool, std::vector<int> taken) {
  std::vector<int> largest;
  while (taken.size() > largest.size()) {
    const std::vector<int> map = pool.Registered(taken);
    if (map.size() > largest.size()) largest = map;
    std::vector<int> rest;
    std::copy_if(taken.begin(), taken.end(), std::back_inserter(rest),
                 [&](int i) { return std::find(map.begin(), map.end(), i) == map.end(); });
    taken = rest;
  }
  std::sort(largest.begin(), largest.end());
  return largest;
}

// What is true and what was said of one surfel.
struct Row {
  double error = 0;  // metres, median of the dense points; NaN: too few
  double completeness = 0;
  SurfelQuality quality;    // as a whole
  double good_share = 0;    // by its pieces
  double density = 0;       // points of the map on it, a cell
  double track_length = 0;  // mean of the map's points around it
  double feedback = 0;      // Q
};

// More pairs of photos than a few make matching no surer, while the depth still gains. Density
// stands for texture.
double CombinedQuality(const Row& row) {
  return (1 + std::min(row.quality.reconstructability, 2.0)) * std::pow(row.density, 0.25) /
         row.quality.sigma;
}

class Comparison {
 public:
  explicit Comparison(const Arguments& arguments)
      : arguments_(arguments), pool_(arguments.pool), distance_(WriteAndRead()) {
    const uint64_t seed = arguments.pool.scenario.seed;
    map_ = pool_.MapOf(LargestMap(pool_, TakeUnevenly(pool_, arguments.share, seed)));
    place_ = AssessPlace(map_.map);
    summary_ = SummarisePlace(place_, map_.map.photos.size());
    target_gsd_ = place_.completeness.target_gsd;
  }

  void Execute() {
    CompareSurfels();
    if (!arguments_.table.empty()) WriteTable();
    if (!arguments_.calibration.empty()) WriteCalibration();
    std::cout << Summarise().dump() << std::endl;
  }

 private:
  SurfaceDistance WriteAndRead() const {
    const TestFolder folder;
    const std::string file = (folder / "surfaces.ply").string();
    sim::WriteSurfaces(file, pool_.place().scene);
    return SurfaceDistance(file);
  }

  void CompareSurfels() {
    const double radius = RadiusOfSurfel(place_.surface);
    const std::vector<TrackFigures> tracks = TracksAround(map_, place_.surface);
    const std::vector<double> feedback = FeedbackQuality(tracks);
    const std::vector<Eigen::Vector3d> dense =
        DenseCloud(pool_, arguments_.pool.threads).Make(map_);
    num_dense_ = dense.size();
    PointGrid grid(2 * target_gsd_), sample_grid(radius);
    for (uint32_t i = 0; i < dense.size(); ++i) grid.Add(dense[i], i);
    for (uint32_t i = 0; i < pool_.samples().size(); ++i) {
      sample_grid.Add(pool_.samples()[i].xyz, i);
    }
    const std::vector<double> good_shares = GoodSharesOf(place_);
    for (size_t i = 0; i < place_.surfels.size(); ++i) {
      const Surfel& surfel = place_.surface.surfels[i];
      Row row;
      row.quality = place_.surfels[i];
      if (!row.quality.counts) continue;
      row.completeness = CompletenessOf(surfel, sample_grid, grid, radius);
      if (std::isnan(row.completeness)) continue;
      row.error = ErrorOf(surfel, grid, radius);
      row.good_share = good_shares[i];
      row.density = surfel.num_points * place_.surface.cell * place_.surface.cell / surfel.area;
      row.track_length = tracks[i].length;
      row.feedback = feedback[i];
      rows_.push_back(row);
    }
    ComparePlace(grid);
  }

  // The true surface that counts, sample by sample: what was said of it and what is so.
  void ComparePlace(const PointGrid& dense) {
    const std::vector<Told> told = WhatIsTold(place_, pool_.samples());
    for (size_t i = 0; i < told.size(); ++i) {
      const SurfaceSample& sample = pool_.samples()[i];
      if (!pool_.Counts(map_.taken, sample, place_.completeness.max_gsd)) continue;
      const bool is_covered = dense.AnyNear(sample.xyz, 2 * target_gsd_);
      shown_.all += 1;
      shown_.with_points += told[i] != Told::kNothing;
      shown_.said += told[i] == Told::kGood;
      shown_.covered += is_covered;
      shown_.said_falsely += told[i] == Told::kGood && !is_covered;
    }
  }

  // Share of the true surface around a surfel that dense points lie on; NaN: there is none.
  double CompletenessOf(const Surfel& surfel, const PointGrid& samples, const PointGrid& dense,
                        double radius) const {
    size_t all = 0, found = 0;
    samples.ForNear(surfel.position, radius, [&](uint32_t i, const Eigen::Vector3d& xyz) {
      if (pool_.samples()[i].normal.dot(surfel.normal) < 0.5) return true;
      ++all;
      found += dense.AnyNear(xyz, 2 * target_gsd_);
      return true;
    });
    if (all < kMinSamples) return std::numeric_limits<double>::quiet_NaN();
    return static_cast<double>(found) / static_cast<double>(all);
  }

  double ErrorOf(const Surfel& surfel, const PointGrid& dense, double radius) const {
    std::vector<Eigen::Vector3d> near;
    dense.ForNear(surfel.position, radius, [&](uint32_t, const Eigen::Vector3d& xyz) {
      near.push_back(xyz);
      return true;
    });
    if (near.size() < kMinPoints) return std::numeric_limits<double>::quiet_NaN();
    std::vector<double> errors;
    const size_t step = (near.size() + kMaxErrors - 1) / kMaxErrors;
    for (size_t i = 0; i < near.size(); i += step) errors.push_back(distance_(near[i]));
    return percentile(errors, 50);
  }

  struct Predictor {
    std::string name;
    std::vector<double> values;  // the higher the better
  };

  // Of the rows that `chosen` names.
  std::vector<Predictor> PredictorsOf(const std::vector<const Row*>& chosen) const {
    std::vector<Predictor> predictors;
    const auto add = [&](const std::string& name, const auto& value) {
      predictors.push_back({name, {}});
      for (const Row* row : chosen) predictors.back().values.push_back(value(*row));
    };
    add("sigma", [](const Row& r) { return -r.quality.sigma; });
    add("reconstructability", [](const Row& r) { return r.quality.reconstructability; });
    add("combined", CombinedQuality);
    add("density", [](const Row& r) { return r.density; });
    add("GSD", [](const Row& r) { return -r.quality.best_gsd; });
    add("photos", [](const Row& r) { return static_cast<double>(r.quality.num_photos); });
    add("good share", [](const Row& r) { return r.good_share; });
    add("texture", [](const Row& r) { return r.quality.textured_share; });
    add("track length", [](const Row& r) { return r.track_length; });
    add("Q", [](const Row& r) { return r.feedback; });
    return predictors;
  }

  static bool IsSaidGood(const Row& row) { return row.good_share >= kTrueCompleteness; }

  bool IsTrulyGood(const Row& row) const {
    return row.error <= kTrueErrorGsd * target_gsd_ && row.completeness >= kTrueCompleteness;
  }

  json Summarise() const {
    std::vector<const Row*> all, with_error;
    std::vector<double> completeness, error;
    std::vector<bool> truly_good;
    for (const Row& row : rows_) {
      all.push_back(&row);
      completeness.push_back(row.completeness);
      truly_good.push_back(IsTrulyGood(row));
      if (std::isnan(row.error)) continue;
      with_error.push_back(&row);
      error.push_back(row.error);
    }
    json summary = {{"scenario", arguments_.scenario},
                    {"seed", arguments_.pool.scenario.seed},
                    {"photos", map_.taken.size()},
                    {"points", map_.map.points.size()},
                    {"dense_points", num_dense_},
                    {"surfels", all.size()},
                    {"with_error", with_error.size()},
                    {"target_gsd", target_gsd_},
                    {"median_error_gsd", percentile(error, 50) / target_gsd_},
                    {"mean_completeness", mean(completeness)}};
    for (const Predictor& p : PredictorsOf(with_error)) {
      summary["error"][p.name] = SpearmanCorrelation(p.values, error);
    }
    for (const Predictor& p : PredictorsOf(all)) {
      summary["completeness"][p.name] = SpearmanCorrelation(p.values, completeness);
      summary["roc_area"][p.name] = AreaUnderRoc(p.values, truly_good);
    }
    summary["good"] = CountGood();
    summary["place"] = PlaceOf();
    return summary;
  }

  json PlaceOf() const {
    const Completeness& said = place_.completeness;
    const double all = std::max(1, shown_.all);
    return {{"verdict", static_cast<int>(summary_.verdict)},
            {"sentence", summary_.sentence},
            {"good_share", said.good_share},
            {"hole_share", said.hole_share},
            {"good_of_shown", said.GoodOfShown()},
            {"open_share", said.open_share},
            {"with_points", shown_.with_points / all},
            {"said_good", shown_.said / all},
            {"covered", shown_.covered / all},
            {"said_falsely", shown_.said_falsely / all}};
  }

  json CountGood() const {
    int said = 0, truly = 0, both = 0;
    for (const Row& row : rows_) {
      said += IsSaidGood(row);
      truly += IsTrulyGood(row);
      both += IsSaidGood(row) && IsTrulyGood(row);
    }
    const int count = static_cast<int>(rows_.size());
    const auto share = [](int part, int whole) { return whole > 0 ? 1.0 * part / whole : 0.0; };
    return {{"said", share(said, count)},
            {"truly", share(truly, count)},
            {"false_share_of_said", share(said - both, said)},
            {"missed_share_of_truly", share(truly - both, truly)},
            {"false_positive_rate", share(said - both, count - truly)}};
  }

  void WriteTable() const {
    std::ofstream out(arguments_.table);
    out << "scenario,seed,sigma_gsd,reconstructability,photos,density,texture,track_length,Q,gsd,"
           "error_gsd,completeness,good_share\n";
    for (const Row& row : rows_) {
      out << arguments_.scenario << "," << arguments_.pool.scenario.seed << ","
          << row.quality.sigma / target_gsd_ << "," << row.quality.reconstructability << ","
          << row.quality.num_photos << "," << row.density << "," << row.quality.textured_share
          << "," << row.track_length << "," << row.feedback << ","
          << row.quality.best_gsd / target_gsd_ << "," << row.error / target_gsd_ << ","
          << row.completeness << "," << row.good_share << "\n";
    }
    out.close();
    if (!out) throw std::runtime_error("cannot write " + arguments_.table);
  }

  // Surfels by tenths, from the worst predicted one: median error, mean completeness, share said to
  // be good.
  void WriteCalibration() const {
    constexpr size_t kBins = 10;
    std::vector<const Row*> sorted;
    for (const Row& row : rows_) sorted.push_back(&row);
    std::stable_sort(sorted.begin(), sorted.end(), [](const Row* a, const Row* b) {
      return CombinedQuality(*a) < CombinedQuality(*b);
    });
    std::ofstream out(arguments_.calibration);
    out << "scenario,seed,bin,error_gsd,completeness,said_good\n";
    for (size_t bin = 0; bin < kBins; ++bin) {
      std::vector<double> errors, completeness, said;
      for (size_t i = bin * sorted.size() / kBins; i < (bin + 1) * sorted.size() / kBins; ++i) {
        const Row& row = *sorted[i];
        if (!std::isnan(row.error)) errors.push_back(row.error / target_gsd_);
        completeness.push_back(row.completeness);
        said.push_back(IsSaidGood(row));
      }
      out << arguments_.scenario << "," << arguments_.pool.scenario.seed << "," << bin + 1 << ",";
      if (!errors.empty()) out << percentile(errors, 50);
      out << "," << mean(completeness) << "," << mean(said) << "\n";
    }
    out.close();
    if (!out) throw std::runtime_error("cannot write " + arguments_.calibration);
  }

  const Arguments arguments_;
  const SyntheticPool pool_;
  const SurfaceDistance distance_;
  PoolMap map_;
  PlaceQuality place_;
  PlaceSummary summary_;
  double target_gsd_ = 0;
  size_t num_dense_ = 0;
  std::vector<Row> rows_;
  struct {
    int all = 0, with_points = 0, said = 0, covered = 0, said_falsely = 0;
  } shown_;  // samples of the true surface
};

}  // namespace
}  // namespace skein

int main(int argc, char** argv) {
  skein::Arguments arguments;
  skein::sim::ScenarioOptions& scenario = arguments.pool.scenario;
  arguments.pool.cache = "/tmp/skein-guidance";
  CLI::App app("Holds predicted quality against a dense matching of the same photos");
  app.add_option("--scenario", arguments.scenario, "of skein sim")
      ->check(CLI::IsMember(skein::sim::ScenarioNames()))
      ->capture_default_str();
  app.add_option("--seed", scenario.seed, "of the place, and of what is taken")
      ->capture_default_str();
  app.add_option("--agents", scenario.agents, "walks")->capture_default_str();
  app.add_option("--photos", scenario.photos, "stations of a walk; each is taken in four ways")
      ->capture_default_str();
  app.add_option("--width", arguments.pool.width, "of a photo; 4:3")
      ->check(CLI::Range(160, 1600))
      ->capture_default_str();
  app.add_option("--share", arguments.share, "of the pool that is taken, about; 7: all of it")
      ->check(CLI::Range(0.01, 7.0))
      ->capture_default_str();
  app.add_option("--cache", arguments.pool.cache, "folder for rendered photos")
      ->capture_default_str();
  app.add_option("--table", arguments.table, "file for a line of CSV a surfel");
  app.add_option("--calibration", arguments.calibration,
                 "file for a line of CSV a tenth of the surfels");
  app.add_option("--threads", arguments.pool.threads)->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  try {
    cv::setNumThreads(1);
    scenario.scenario = *skein::sim::ParseScenario(arguments.scenario);
    arguments.pool.height = arguments.pool.width * 3 / 4;
    skein::Comparison(arguments).Execute();
    return 0;
  } catch (const std::exception& error) {
    std::cerr << "guidance_prediction: " << error.what() << "\n";
    return 1;
  }
}
