#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>

#include "core/bytes.h"
#include "core/result.h"

namespace skein {

// What VLAD needs besides the photo. Matrices are row major in the file: little-endian float32.
// File: 'SKCB', uint32 version, text `id`, then each matrix as uint32 rows, uint32 columns, values;
// last the SHA-256 of everything before it, as 64 hex digits.
struct Codebook {
  static constexpr int kDescriptorDim = 128;

  using Matrix = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  std::string id;        // names training set and version; descriptors of two ids never mix
  Eigen::VectorXf mean;  // 128; of RootSIFT of unit length
  Matrix projection;     // L x 128: principal axes of RootSIFT
  Matrix centres;        // K x L: cells of the projected descriptors
  Matrix cell_axes;  // K*C x L: rows k*C .. k*C+C-1 are the principal axes of cell k's residuals
  Eigen::VectorXf cell_weights;  // K: how much a cell counts

  int local_dim() const { return static_cast<int>(projection.rows()); }
  int num_cells() const { return static_cast<int>(centres.rows()); }
  int cell_dim() const {
    return num_cells() == 0 ? 0 : static_cast<int>(cell_axes.rows()) / num_cells();
  }
};

Bytes EncodeCodebook(const Codebook& codebook);
// Error: no codebook, another version, damaged, or matrices that do not fit together.
Result<Codebook> DecodeCodebook(const Bytes& bytes);
Result<Codebook> LoadCodebook(const std::string& path);

// N x 128 uint8 RootSIFT -> N x L: unit length, minus mean, projected.
Codebook::Matrix ProjectDescriptors(const Codebook& codebook, const uint8_t* descriptors, size_t n);

// Index of the nearest row of `centres` for each row of `points`.
std::vector<int> NearestCentres(const Codebook::Matrix& points, const Codebook::Matrix& centres);

}  // namespace skein
