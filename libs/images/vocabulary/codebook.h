#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>

#include "core/bytes.h"
#include "core/result.h"

namespace skein {

// How the descriptors of a photo are aggregated. The learned values hold for these alone, so the
// file says them, too.
constexpr uint32_t kVladFeatures = 4000;  // features of largest scale are used
constexpr float kVladScaleExponent = 1;   // weight of a descriptor = scale^exponent
constexpr float kVladPower = 0.4f;        // x -> sign(x) |x|^power

// VLAD's learned values. Matrices are row major; in the file little-endian float32.
//
// File: 'SKCB', uint32 version, text `id`, the three constants above in order. Then each matrix as
// uint32 rows, uint32 columns, values. Last the SHA-256 of everything before it, as 64 hex digits.
struct Codebook {
  using Matrix = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  std::string id;        // names training set and version; descriptors of two ids never mix
  Eigen::VectorXf mean;  // 128; of RootSIFT of unit length
  Matrix projection;     // L x 128: principal axes of RootSIFT
  Matrix centres;        // K x L: cells of the projected descriptors
  Matrix cell_axes;  // K*C x L: rows k*C .. k*C+C-1 are the principal axes of cell k's residuals
  Eigen::VectorXf photo_mean;  // K*C: mean vector of the training photos

  int local_dim() const { return static_cast<int>(projection.rows()); }
  int num_cells() const { return static_cast<int>(centres.rows()); }
  int cell_dim() const {
    return num_cells() == 0 ? 0 : static_cast<int>(cell_axes.rows()) / num_cells();
  }
};

Bytes EncodeCodebook(const Codebook& codebook);
// Error: no codebook, another version, other constants, damaged, or matrices that do not fit
// together.
Result<Codebook> DecodeCodebook(const Bytes& bytes);
Result<Codebook> LoadCodebook(const std::string& path);

// Codebook in `path`, or the shipped one if that is "": in data/ beside the folder of the program
// (cmake/SkeinInstall.cmake). Throws std::invalid_argument, saying why and what to do, if it cannot
// be used.
Codebook CodebookOf(const std::string& path);

// N x 128 uint8 RootSIFT -> N x L: unit length, minus mean, projected.
Codebook::Matrix ProjectDescriptors(const Codebook& codebook, const uint8_t* descriptors, size_t n);

// Index of the nearest row of `centres` for each row of `points`.
std::vector<int> NearestCentres(const Codebook::Matrix& points, const Codebook::Matrix& centres);

}  // namespace skein
