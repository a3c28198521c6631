#include "texture/photo_gains.h"

#include <Eigen/Geometry>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

namespace skein {
namespace {

constexpr size_t kMostSamples = 100'000;       // triangles
constexpr int kDarkest = 8, kBrightest = 247;  // levels that tell a ratio
constexpr double kPrior = 1;                   // weight of a gain of 1, in pairs of views

class GainSolver {
 public:
  GainSolver(const SurfaceMesh& mesh, const std::vector<ColouredMap>& maps)
      : mesh_(mesh), maps_(maps), right_(Eigen::MatrixX3d::Zero(maps.size(), 3)) {
    for (size_t i = 0; i < maps.size(); ++i) AddTerm(i, i, kPrior);
  }

  void Add(size_t triangle, const TriangleViews& views) {
    std::vector<std::pair<int32_t, Eigen::RowVector3d>> colours;  // of photos, logarithms
    for (int i = 0; i < views.count; ++i) {
      const auto colour = LogColour(triangle, views.photo[i]);
      if (!colour) continue;
      for (const auto& [photo, other] : colours) AddPair(photo, views.photo[i], *colour - other);
      colours.emplace_back(views.photo[i], *colour);
    }
  }

  std::vector<ColourGain> Solve() const {
    const auto size = static_cast<Eigen::Index>(maps_.size());
    Eigen::SparseMatrix<double> matrix(size, size);
    matrix.setFromTriplets(terms_.begin(), terms_.end());
    const Eigen::MatrixX3d logs =
        Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>(matrix).solve(right_);
    std::vector<ColourGain> gains;
    for (Eigen::Index i = 0; i < size; ++i) {
      gains.push_back({std::exp(logs(i, 0)), std::exp(logs(i, 1)), std::exp(logs(i, 2))});
    }
    return gains;
  }

 private:
  // nullopt: a channel tells no ratio.
  std::optional<Eigen::RowVector3d> LogColour(size_t triangle, int32_t photo) const {
    const ColouredMap& map = maps_[photo];
    Eigen::Vector3d middle = mesh_.origin;
    for (int k = 0; k < 3; ++k) {
      middle += mesh_.vertices[mesh_.indices[3 * triangle + k]].position.cast<double>() / 3;
    }
    const Eigen::Vector3d in_camera = map.map->cam_from_world.ToCamera(middle);
    const Eigen::Vector2d pixel = map.map->camera.Pixel(in_camera.hnormalized());
    const cv::Vec3b& colour =
        (*map.colours)(static_cast<int>(pixel.y()), static_cast<int>(pixel.x()));
    Eigen::RowVector3d logs;
    for (int c = 0; c < 3; ++c) {
      if (colour[c] < kDarkest || colour[c] > kBrightest) return std::nullopt;
      logs[c] = std::log(colour[c]);
    }
    return logs;
  }

  // gain of i - gain of j = difference, in logarithms.
  void AddPair(size_t i, size_t j, const Eigen::RowVector3d& difference) {
    AddTerm(i, i, 1);
    AddTerm(j, j, 1);
    AddTerm(i, j, -1);
    AddTerm(j, i, -1);
    right_.row(static_cast<Eigen::Index>(i)) += difference;
    right_.row(static_cast<Eigen::Index>(j)) -= difference;
  }

  void AddTerm(size_t i, size_t j, double value) {
    terms_.emplace_back(static_cast<int>(i), static_cast<int>(j), value);
  }

  const SurfaceMesh& mesh_;
  const std::vector<ColouredMap>& maps_;
  std::vector<Eigen::Triplet<double>> terms_;  // of the normal equations
  Eigen::MatrixX3d right_;
};

}  // namespace

std::vector<ColourGain> PhotoGains(const SurfaceMesh& mesh, const std::vector<ColouredMap>& maps,
                                   const std::vector<TriangleViews>& views) {
  GainSolver solver(mesh, maps);
  const size_t step = views.size() / kMostSamples + 1;
  for (size_t i = 0; i < views.size(); i += step) solver.Add(i, views[i]);
  return solver.Solve();
}

}  // namespace skein
