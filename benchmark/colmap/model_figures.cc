// model_figures: figures of a COLMAP model for a comparison, as one line of JSON. All figures are
// computed from poses, points and observations; errors stored in the files are ignored.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <iostream>
#include <nlohmann/json.hpp>
#include <numeric>
#include <stdexcept>
#include <vector>

#include "benchmark/support/surface_distance.h"
#include "geometry/model_poses.h"
#include "geometry/pose_evaluation.h"
#include "sfm/model_files.h"
#include "sfm/reprojection.h"

namespace skein {
namespace {

using nlohmann::json;

struct Arguments {
  std::string model, truth, surfaces, reference;
};

PoseEvaluation Compare(const std::string& model, const std::string& with) {
  const Result<ModelPoses> poses = ReadPoses(model), others = ReadPoses(with);
  if (!poses) throw std::runtime_error(poses.error());
  if (!others) throw std::runtime_error(others.error());
  const Result<PoseEvaluation> evaluation = EvaluatePoses(*poses, *others);
  if (!evaluation) throw std::runtime_error(model + ": " + evaluation.error());
  return *evaluation;
}

// Mean reprojection error over points, each the mean over its observations, as COLMAP's
// model_analyzer has it.
double MeanReprojectionError(const Reconstruction& model) {
  double sum = 0;
  for (const auto& [id, point] : model.Points3D()) {
    double of_point = 0;
    for (const TrackElement& element : point.Track().Elements()) {
      const Image& image = model.Image(element.image_id);
      of_point += std::sqrt(CalculateSquaredReprojectionError(
          image.Point2D(element.point2D_idx).XY(), point.XYZ(), image.Qvec(), image.Tvec(),
          model.Camera(image.CameraId())));
    }
    sum += of_point / static_cast<double>(point.Track().Length());
  }
  return sum / static_cast<double>(std::max<size_t>(1, model.NumPoints3D()));
}

json PointErrors(const Reconstruction& model, const Similarity& truth_from_model,
                 const std::string& surfaces) {
  const SurfaceDistance distance(surfaces);
  std::vector<double> errors;
  for (const auto& [id, point] : model.Points3D()) {
    errors.push_back(distance(truth_from_model.Apply(point.XYZ())));
  }
  if (errors.empty()) return nullptr;
  std::sort(errors.begin(), errors.end());
  return {{"mean", std::accumulate(errors.begin(), errors.end(), 0.0) / errors.size()},
          {"median", errors[errors.size() / 2]},
          {"p90", errors[errors.size() * 9 / 10]}};
}

json Figures(const Arguments& arguments) {
  const Result<Reconstruction> read = ReadModelFiles(arguments.model);
  if (!read) throw std::runtime_error(read.error());
  const Reconstruction& model = *read;
  json figures = {{"registered", model.NumRegImages()},
                  {"points", model.NumPoints3D()},
                  {"mre_px", MeanReprojectionError(model)},
                  {"mtl", model.ComputeMeanTrackLength()}};
  if (!arguments.truth.empty()) {
    const PoseEvaluation evaluation = Compare(arguments.model, arguments.truth);
    figures["position_percent"] = evaluation.PositionPercent(evaluation.position.rmse);
    if (!arguments.surfaces.empty()) {
      figures["point_error"] =
          PointErrors(model, evaluation.truth_from_estimate, arguments.surfaces);
    }
  }
  if (!arguments.reference.empty()) {
    const PoseEvaluation evaluation = Compare(arguments.model, arguments.reference);
    figures["rotation_mean_deg"] = evaluation.rotation_deg.mean;
    figures["rotation_max_deg"] = evaluation.rotation_deg.max;
    figures["displacement_percent"] = evaluation.PositionPercent(evaluation.position.rmse);
  }
  return figures;
}

}  // namespace
}  // namespace skein

int main(int argc, char** argv) {
  skein::Arguments arguments;
  CLI::App app("Figures of a COLMAP model, as JSON");
  app.add_option("MODEL", arguments.model, "COLMAP model")
      ->required()
      ->check(CLI::ExistingDirectory);
  app.add_option("--truth", arguments.truth, "what `skein evaluate` takes: errors of the positions")
      ->check(CLI::ExistingPath);
  app.add_option("--surfaces", arguments.surfaces,
                 "mesh of true surfaces in the truth's frame (surfaces.ply of `skein sim`): "
                 "distances of the points to them")
      ->check(CLI::ExistingFile);
  app.add_option("--reference", arguments.reference, "another model: discrepancies to it")
      ->check(CLI::ExistingDirectory);
  CLI11_PARSE(app, argc, argv);
  try {
    std::cout << skein::Figures(arguments).dump() << std::endl;
    return 0;
  } catch (const std::exception& error) {
    std::cerr << "model_figures: " << error.what() << "\n";
    return 1;
  }
}
