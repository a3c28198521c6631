// surface_accuracy: a surface of `skein export` against the true one of a place of `skein sim`.
//
//   surface_accuracy OUT/0 PLACE/truth [--volume]
//
// OUT/0: of `skein export --format bin,dense,mesh`; the points, the mesh or both. The model's
// camera centres give the similarity to the truth. A row for each distance d, in ground sampling
// distances (GSD: median over the true photos of the median true depth over the focal length).
// Accuracy is the share of the points, or of samples of the mesh, within d of a true surface.
// Completeness is the share of samples of the true surface within d of a point or of the mesh; a
// sample counts if a photo and two more, 1 to 45 degrees aside, see it. F1 is the harmonic mean of
// both. Samples are uniform by area.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <iostream>
#include <iterator>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "benchmark/depth/depth_truth.h"
#include "benchmark/support/point_grid.h"
#include "benchmark/support/surface_distance.h"
#include "benchmark/support/volume_over_plane.h"
#include "clients/places/outdoors.h"
#include "clients/places/solids.h"
#include "core/statistics.h"
#include "depth/depth_scene.h"
#include "geometry/pose_evaluation.h"
#include "sfm/model_files.h"

namespace skein {
namespace {

using Points = std::vector<Eigen::Vector3d>;

constexpr double kWithinGsd[] = {1, 2, 5};
constexpr size_t kSamples = 100'000;      // of a surface that is measured
constexpr size_t kTrueSamples = 400'000;  // of all true surfaces, seen or not
constexpr int kDepthSide = 80;            // of a true depth map: enough for a median
constexpr int kOutlineCorners = 24;       // of the stockpile's outline
constexpr double kOutlineRadius = 1.25;   // of the stockpile's

struct Truth {
  PlyMesh mesh;
  sim::Scene scene;
  std::vector<DepthPhoto> photos;  // without pixels
  std::vector<double> gsds;        // of the photos that see more than the sky
};

double MedianDepth(const cv::Mat1f& depth) {
  std::vector<double> depths;
  std::copy_if(depth.begin(), depth.end(), std::back_inserter(depths),
               [](float d) { return d > 0; });
  return percentile(std::move(depths), 50);
}

Truth ReadTruth(const std::string& folder) {
  const std::string surfaces = folder + "/surfaces.ply";
  Truth truth{ReadPlyMesh(surfaces), ReadSurfaces(surfaces), {}, {}};
  const Result<Reconstruction> model = ReadModelFiles(folder);
  if (!model) throw std::runtime_error(model.error());
  const DepthScene scene = DepthSceneOf(*model);
  for (size_t i = 0; i < scene.photos.size(); ++i) {
    const DepthPhoto photo{
        {}, {}, PhotoTable(scene.lenses[i], kDepthSide).camera(), scene.photos[i].cam_from_world};
    const double depth = MedianDepth(TrueDepth(truth.scene, photo.camera, photo.cam_from_world));
    if (depth > 0) truth.gsds.push_back(depth / scene.lenses[i].focal_px.x());
    truth.photos.push_back(photo);
  }
  return truth;
}

Points SeenSamples(const Truth& truth) {
  const TruePlace place(truth.scene, truth.photos);
  Points seen;
  for (const Eigen::Vector3d& sample : SampleByArea(truth.mesh, kTrueSamples)) {
    for (int i = 0; i < static_cast<int>(truth.photos.size()); ++i) {
      if (!place.Sees(i, sample) || !place.IsSeenByThree(i, sample)) continue;
      seen.push_back(sample);
      break;
    }
  }
  return seen;
}

// ---- What is measured, in the truth's frame ----

struct Estimate {
  std::string name;
  Points samples;
  // Exact up to the largest distance of the table.
  std::function<double(const Eigen::Vector3d&)> distance;
};

Estimate EstimateOf(const std::string& name, const PlyMesh& mesh, double reach) {
  if (!mesh.faces.empty()) {
    return {name, SampleByArea(mesh, kSamples), SurfaceDistance(mesh)};
  }
  Points samples;
  PointGrid grid(reach);
  const size_t step = mesh.vertices.size() / kSamples + 1;
  for (size_t i = 0; i < mesh.vertices.size(); ++i) {
    grid.Add(mesh.vertices[i], static_cast<uint32_t>(i));
    if (i % step == 0) samples.push_back(mesh.vertices[i]);
  }
  return {name, samples, [grid = std::move(grid), reach](const Eigen::Vector3d& from) {
            double nearest = std::numeric_limits<double>::infinity();
            grid.ForNear(from, reach, [&](uint32_t, const Eigen::Vector3d& point) {
              nearest = std::min(nearest, (point - from).norm());
              return true;
            });
            return nearest;
          }};
}

template <typename Distance>
std::vector<double> Distances(const Points& points, const Distance& distance) {
  std::vector<double> distances;
  for (const Eigen::Vector3d& point : points) distances.push_back(distance(point));
  return distances;
}

double ShareWithin(const std::vector<double>& distances, double limit) {
  if (distances.empty()) return 0;
  const auto near = std::count_if(distances.begin(), distances.end(),
                                  [&](double distance) { return distance <= limit; });
  return static_cast<double>(near) / static_cast<double>(distances.size());
}

void PrintRows(const Estimate& estimate, const SurfaceDistance& to_truth, const Points& seen,
               double gsd) {
  const std::vector<double> errors = Distances(estimate.samples, to_truth);
  const std::vector<double> gaps = Distances(seen, estimate.distance);
  for (const double factor : kWithinGsd) {
    const double accuracy = ShareWithin(errors, factor * gsd);
    const double completeness = ShareWithin(gaps, factor * gsd);
    const double sum = accuracy + completeness;
    std::printf("%-8s %6.0f %10.4f %13.4f %8.4f\n", estimate.name.c_str(), factor, accuracy,
                completeness, sum > 0 ? 2 * accuracy * completeness / sum : 0);
  }
}

// ---- The stockpile ----

void RequireStockpile(const PlyMesh& truth) {
  double top = 0;
  for (const Eigen::Vector3d& vertex : truth.vertices) top = std::max(top, vertex.z());
  if (std::abs(top - sim::kStockpileHeightM) > 1e-6) {
    throw std::runtime_error("--volume takes a place of --scenario stockpile");
  }
}

void PrintVolume(const std::string& name, const Points& points) {
  Points outline;
  for (int i = 0; i < kOutlineCorners; ++i) {
    const double angle = 2 * M_PI * i / kOutlineCorners;
    outline.push_back(kOutlineRadius * sim::kStockpileRadiusM *
                      Eigen::Vector3d(std::cos(angle), std::sin(angle), 0));
  }
  const auto volume = VolumeOverPlane(points, outline, Eigen::Vector3d::UnitZ());
  if (!volume) throw std::runtime_error(name + ": hardly a point on the stockpile");
  const double exact = sim::ConeVolume(sim::kStockpileRadiusM, sim::kStockpileHeightM);
  const double net = volume->above - volume->below;
  std::printf(
      "%-8s volume %.2f m3 (%.2f above, %.2f below), exact %.2f m3, error %+.2f %%, "
      "cells of %.3f m, %.2f %% without points\n",
      name.c_str(), net, volume->above, volume->below, exact, 100 * (net / exact - 1), volume->cell,
      100 * volume->filled);
}

// ----

struct Arguments {
  std::string exported, truth;
  bool volume = false;
};

PoseEvaluation Align(const Arguments& arguments) {
  const Result<ModelPoses> model = ReadPoses(arguments.exported),
                           truth = ReadPoses(arguments.truth);
  if (!model) throw std::runtime_error(model.error());
  if (!truth) throw std::runtime_error(truth.error());
  const Result<PoseEvaluation> evaluation = EvaluatePoses(*model, *truth);
  if (!evaluation) throw std::runtime_error(evaluation.error());
  return *evaluation;
}

// Points and mesh of the export, as far as they are there, in the truth's frame.
std::vector<std::pair<std::string, PlyMesh>> ReadSurfacesOf(const std::string& exported,
                                                            const Similarity& truth_from_model) {
  std::vector<std::pair<std::string, PlyMesh>> read;
  for (const std::string name : {"dense", "mesh"}) {
    const std::string file = exported + "/" + name + ".ply";
    if (!std::filesystem::exists(file)) continue;
    read.emplace_back(name, ReadPlyMesh(file));
    for (Eigen::Vector3d& v : read.back().second.vertices) v = truth_from_model.Apply(v);
  }
  if (read.empty()) throw std::runtime_error(exported + ": neither dense.ply nor mesh.ply");
  return read;
}

void Run(const Arguments& arguments) {
  const PoseEvaluation poses = Align(arguments);
  const auto surfaces = ReadSurfacesOf(arguments.exported, poses.truth_from_estimate);
  const Truth truth = ReadTruth(arguments.truth);
  if (arguments.volume) RequireStockpile(truth.mesh);
  const double gsd = percentile(truth.gsds, 50);
  const Points seen = SeenSamples(truth);
  std::printf(
      "photos %zu of %zu, GSD %.5f m, samples of the true surface that three photos see: %zu\n",
      poses.registered, poses.total, gsd, seen.size());
  std::printf("%-8s %6s %10s %13s %8s\n", "surface", "GSD", "accuracy", "completeness", "F1");
  const SurfaceDistance to_truth(truth.mesh);
  for (const auto& [name, mesh] : surfaces) {
    const double reach = gsd * kWithinGsd[std::size(kWithinGsd) - 1];
    PrintRows(EstimateOf(name, mesh, reach), to_truth, seen, gsd);
  }
  if (!arguments.volume) return;
  for (const auto& [name, mesh] : surfaces) PrintVolume(name, mesh.vertices);
}

}  // namespace
}  // namespace skein

int main(int argc, char** argv) {
  skein::Arguments arguments;
  CLI::App app("Accuracy and completeness of an exported surface");
  app.add_option("EXPORT", arguments.exported, "OUT/N of `skein export --format bin,dense,mesh`")
      ->required()
      ->check(CLI::ExistingDirectory);
  app.add_option("TRUTH", arguments.truth, "the folder `truth` of `skein sim`")
      ->required()
      ->check(CLI::ExistingDirectory);
  app.add_flag("--volume", arguments.volume, "also the volume of --scenario stockpile's heap");
  CLI11_PARSE(app, argc, argv);
  try {
    skein::Run(arguments);
    return 0;
  } catch (const std::exception& error) {
    std::cerr << "surface_accuracy: " << error.what() << "\n";
    return 1;
  }
}
