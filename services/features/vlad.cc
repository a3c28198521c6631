#include "features/vlad.h"

#include <algorithm>
#include <utility>

namespace skein {
namespace {

using Matrix = Codebook::Matrix;

// K x L: sums of the unit residuals of each cell.
Matrix SumResiduals(const Matrix& points, const Matrix& centres) {
  const std::vector<int> cells = NearestCentres(points, centres);
  Matrix sums = Matrix::Zero(centres.rows(), centres.cols());
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    sums.row(cells[i]) += (points.row(i) - centres.row(cells[i])).normalized();
  }
  return sums;
}

}  // namespace

VladModel::VladModel(Codebook codebook, const VladOptions& options)
    : codebook_(std::move(codebook)), options_(options) {}

std::vector<float> VladModel::Describe(const DescribedPhoto& photo) {
  const Descriptors& descriptors = photo.features->descriptors;
  const size_t n = std::min<size_t>(descriptors.rows(), options_.max_features);
  return DescribeDescriptors(descriptors.data.data(), n);
}

std::vector<float> VladModel::DescribeDescriptors(const uint8_t* descriptors, size_t n) const {
  if (n == 0) return {};
  const Matrix points = ProjectDescriptors(codebook_, descriptors, n);
  const Matrix sums = SumResiduals(points, codebook_.centres);
  const int cell_dim = codebook_.cell_dim();
  std::vector<float> values(dim());
  Eigen::Map<Eigen::VectorXf> all(values.data(), dim());
  for (int k = 0; k < codebook_.num_cells(); ++k) {
    auto cell = all.segment(k * cell_dim, cell_dim);
    cell = codebook_.cell_axes.middleRows(k * cell_dim, cell_dim) * sums.row(k).transpose();
    cell = cell.array().sign() * cell.array().abs().pow(options_.power);
    cell.normalize();  // a zero vector stays zero
    cell *= codebook_.cell_weights[k];
  }
  all.normalize();
  if (all.squaredNorm() == 0) return {};
  return values;
}

}  // namespace skein
