#include "clients/evaluate.h"

#include <cstdio>
#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <vector>

#include "clients/subcommand.h"
#include "geometry/pose_evaluation.h"

namespace skein {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

bool IsModel(const fs::path& path) {
  return !fs::is_directory(path) || fs::exists(path / "images.bin") ||
         fs::exists(path / "images.txt");
}

// MODEL itself, or the numbered models in it or in its sparse/ (a session folder), 0 first.
std::vector<fs::path> FindModels(const fs::path& path) {
  if (IsModel(path)) return {path};
  for (const fs::path& folder : {path, path / "sparse"}) {
    std::vector<fs::path> models;
    for (int i = 0; IsModel(folder / std::to_string(i)) && fs::exists(folder / std::to_string(i));
         ++i) {
      models.push_back(folder / std::to_string(i));
    }
    if (!models.empty()) return models;
  }
  return {path};
}

struct Evaluated {
  fs::path model;
  PointStatistics points;
  PoseEvaluation poses;
};

json ToJson(const Evaluated& e) {
  const PoseEvaluation& p = e.poses;
  return {{"model", e.model.string()},
          {"registered", p.registered},
          {"total", p.total},
          {"extent", p.extent},
          {"aligned_by_orientation", p.aligned_by_orientation},
          {"scale", p.truth_from_estimate.scale},
          {"position_rmse", p.position.rmse},
          {"position_median", p.position.median},
          {"position_max", p.position.max},
          {"position_rmse_percent", p.PositionPercent(p.position.rmse)},
          {"position_median_percent", p.PositionPercent(p.position.median)},
          {"position_max_percent", p.PositionPercent(p.position.max)},
          {"rotation_mean_deg", p.rotation_deg.mean},
          {"rotation_median_deg", p.rotation_deg.median},
          {"rotation_max_deg", p.rotation_deg.max},
          {"auc_1deg", p.auc_1deg},
          {"auc_3deg", p.auc_3deg},
          {"auc_5deg", p.auc_5deg},
          {"points", e.points.points},
          {"mean_reprojection_error_px", e.points.mean_reprojection_error_px},
          {"mean_track_length", e.points.mean_track_length}};
}

void Print(const Evaluated& e) {
  const PoseEvaluation& p = e.poses;
  std::printf("model             %s\n", e.model.c_str());
  std::printf("registered        %zu/%zu\n", p.registered, p.total);
  std::printf("position          RMSE %.6g, median %.6g, max %.6g\n", p.position.rmse,
              p.position.median, p.position.max);
  std::printf("  %% of the extent RMSE %.4f, median %.4f, max %.4f (extent %.6g)\n",
              p.PositionPercent(p.position.rmse), p.PositionPercent(p.position.median),
              p.PositionPercent(p.position.max), p.extent);
  std::printf("rotation deg      mean %.4f, median %.4f, max %.4f%s\n", p.rotation_deg.mean,
              p.rotation_deg.median, p.rotation_deg.max,
              p.aligned_by_orientation ? " (centres on a line: aligned by orientation)" : "");
  std::printf("relative poses    AUC@1 %.4f, AUC@3 %.4f, AUC@5 %.4f\n", p.auc_1deg, p.auc_3deg,
              p.auc_5deg);
  std::printf("points            %zu, mean reprojection error %.3f px, mean track length %.2f\n",
              e.points.points, e.points.mean_reprojection_error_px, e.points.mean_track_length);
}

// Fails for a model that has too little in common with the truth. Throws for one that cannot be
// read.
Result<Evaluated> Evaluate(const fs::path& model, const ModelPoses& truth) {
  const Result<ModelPoses> estimate = ReadPoses(model);
  if (!estimate) throw std::runtime_error(estimate.error());
  const Result<PoseEvaluation> poses = EvaluatePoses(*estimate, truth);
  if (!poses) return poses.status().Within(model.string());
  return Evaluated{model, estimate->points, *poses};
}

}  // namespace

int RunEvaluate(int argc, char** argv) {
  std::string model, truth_path;
  bool as_json = false;
  CLI::App app(
      "Compares a model's camera poses with a ground truth: registered photos, position and\n"
      "rotation errors after a similarity alignment over all common camera centres, AUC of\n"
      "relative poses. The extent is the largest distance between two true camera centres.",
      "skein evaluate");
  app.add_option("MODEL", model,
                 "COLMAP model (bin or text), or a folder of them (sparse, a session)")
      ->required();
  app.add_option("GROUND_TRUTH", truth_path,
                 "Folder of Strecha .camera files, COLMAP model, Middlebury *_par.txt, or file of\n"
                 "TUM lines (time or name, tx ty tz, qx qy qz qw)")
      ->required();
  app.add_flag("--json", as_json,
               "Print JSON; the figures of the first model that was compared on top");
  app.footer(
      "Exit codes: 0 a model was compared (what could not be is told), 1 none could be or error,\n"
      "2 bad usage.");
  if (const auto code = ParseOptions(&app, argc, argv)) return *code;

  const Result<ModelPoses> truth = ReadPoses(truth_path);
  if (!truth) throw std::runtime_error(truth.error());
  std::vector<Evaluated> all;
  json not_compared = json::array();
  for (const fs::path& path : FindModels(model)) {
    Result<Evaluated> evaluated = Evaluate(path, *truth);
    if (evaluated.ok()) {
      all.push_back(*std::move(evaluated));
    } else {
      not_compared.push_back({{"model", path.string()}, {"reason", evaluated.error()}});
      std::cerr << "skein evaluate: not compared: " << evaluated.error() << std::endl;
    }
  }
  if (all.empty()) return kExitError;
  if (as_json) {
    json report = ToJson(all.front());
    for (const Evaluated& evaluated : all) report["models"].push_back(ToJson(evaluated));
    report["not_compared"] = not_compared;
    std::cout << report.dump(2) << "\n";
  } else {
    for (const Evaluated& evaluated : all) Print(evaluated);
  }
  return kExitOk;
}

}  // namespace skein
