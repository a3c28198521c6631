#include "features/vlad.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace skein {
namespace {

using Matrix = Codebook::Matrix;

struct Weighted {
  Matrix points;               // N x L
  std::vector<float> weights;  // N
};

std::vector<size_t> LargestFirst(const Keypoints& keypoints, size_t count) {
  std::vector<size_t> order(keypoints.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) {
    return keypoints[a].scale_px > keypoints[b].scale_px;
  });
  order.resize(std::min(order.size(), count));
  return order;
}

Weighted ChooseAndProject(const Codebook& codebook, const LocalFeatures& features) {
  Weighted chosen;
  std::vector<uint8_t> rows;
  for (const size_t i : LargestFirst(features.keypoints, kVladFeatures)) {
    const uint8_t* row = features.descriptors.row(i);
    rows.insert(rows.end(), row, row + Descriptors::kDim);
    chosen.weights.push_back(std::pow(features.keypoints[i].scale_px, kVladScaleExponent));
  }
  chosen.points = ProjectDescriptors(codebook, rows.data(), chosen.weights.size());
  return chosen;
}

// K x L: weighted sums of the unit residuals of each cell.
Matrix SumResiduals(const Weighted& chosen, const Matrix& centres) {
  const std::vector<int> cells = NearestCentres(chosen.points, centres);
  Matrix sums = Matrix::Zero(centres.rows(), centres.cols());
  for (Eigen::Index i = 0; i < chosen.points.rows(); ++i) {
    const Eigen::RowVectorXf residual = chosen.points.row(i) - centres.row(cells[i]);
    sums.row(cells[i]) += chosen.weights[i] * residual.normalized();
  }
  return sums;
}

}  // namespace

Eigen::VectorXf AggregateVlad(const Codebook& codebook, const LocalFeatures& features) {
  Eigen::VectorXf values = Eigen::VectorXf::Zero(codebook.cell_axes.rows());
  if (features.keypoints.empty()) return values;
  const Matrix sums = SumResiduals(ChooseAndProject(codebook, features), codebook.centres);
  const int cell_dim = codebook.cell_dim();
  for (int k = 0; k < codebook.num_cells(); ++k) {
    auto cell = values.segment(k * cell_dim, cell_dim);
    cell = codebook.cell_axes.middleRows(k * cell_dim, cell_dim) * sums.row(k).transpose();
    cell = cell.array().sign() * cell.array().abs().pow(kVladPower);
    cell.normalize();  // a zero vector stays zero
  }
  values.normalize();
  return values;
}

VladModel::VladModel(Codebook codebook) : codebook_(std::move(codebook)) {}

std::vector<float> VladModel::Describe(const DescribedPhoto& photo) {
  return DescribeFeatures(*photo.features);
}

std::vector<float> VladModel::DescribeFeatures(const LocalFeatures& features) const {
  Eigen::VectorXf values = AggregateVlad(codebook_, features);
  if (values.squaredNorm() == 0) return {};
  values -= codebook_.photo_mean;
  values.normalize();
  return {values.data(), values.data() + values.size()};
}

}  // namespace skein
