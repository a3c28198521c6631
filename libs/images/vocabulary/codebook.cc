#include "vocabulary/codebook.h"

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <vector>

#include "core/file.h"
#include "core/hash.h"
#include "core/local_descriptor.h"

namespace skein {
namespace {

using Matrix = Codebook::Matrix;

constexpr char kMagic[4] = {'S', 'K', 'C', 'B'};
constexpr uint32_t kVersion = 1;
constexpr char kFileName[] = "vlad_codebook.bin";

void PutMatrix(const Matrix& matrix, ByteWriter* writer) {
  writer->Put(static_cast<uint32_t>(matrix.rows()));
  writer->Put(static_cast<uint32_t>(matrix.cols()));
  writer->PutRaw(matrix.data(), matrix.size() * sizeof(float));
}

bool GetMatrix(ByteReader* reader, Matrix* matrix) {
  uint32_t rows = 0;
  uint32_t columns = 0;
  if (!reader->Get(&rows) || !reader->Get(&columns)) return false;
  const uint64_t size = uint64_t{rows} * columns * sizeof(float);
  if (size > reader->remaining()) return false;
  matrix->resize(rows, columns);
  return reader->GetRaw(matrix->data(), size) && matrix->allFinite();
}

bool GetVector(ByteReader* reader, Eigen::VectorXf* vector) {
  Matrix column;
  if (!GetMatrix(reader, &column) || column.cols() != 1) return false;
  *vector = column;
  return true;
}

bool FitTogether(const Codebook& c) {
  return c.mean.size() == kDescriptorDim && c.projection.cols() == kDescriptorDim &&
         c.local_dim() > 0 && c.num_cells() > 0 && c.centres.cols() == c.local_dim() &&
         c.cell_axes.cols() == c.local_dim() && c.cell_dim() > 0 &&
         c.cell_axes.rows() == static_cast<Eigen::Index>(c.num_cells()) * c.cell_dim() &&
         c.photo_mean.size() == c.cell_axes.rows();
}

std::string ShippedPath() {
  std::error_code error;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", error);
  return program.parent_path().parent_path() / "data" / kFileName;
}

}  // namespace

Bytes EncodeCodebook(const Codebook& codebook) {
  ByteWriter writer;
  writer.PutRaw(kMagic, sizeof(kMagic));
  writer.Put(kVersion);
  writer.PutString(codebook.id);
  writer.Put(kVladFeatures);
  writer.Put(kVladScaleExponent);
  writer.Put(kVladPower);
  PutMatrix(codebook.mean, &writer);
  PutMatrix(codebook.projection, &writer);
  PutMatrix(codebook.centres, &writer);
  PutMatrix(codebook.cell_axes, &writer);
  PutMatrix(codebook.photo_mean, &writer);
  const std::string checksum = HashBytes(writer.bytes().data(), writer.size());
  writer.PutRaw(checksum.data(), checksum.size());
  return writer.Take();
}

Result<Codebook> DecodeCodebook(const Bytes& bytes) {
  if (bytes.size() < sizeof(kMagic) + sizeof(kVersion) + kHashSize ||
      std::memcmp(bytes.data(), kMagic, sizeof(kMagic)) != 0) {
    return DataLoss("not a codebook");
  }
  const size_t size = bytes.size() - kHashSize;
  ByteReader reader(bytes.data() + sizeof(kMagic), size - sizeof(kMagic));
  uint32_t version = 0;
  reader.Get(&version);
  if (version != kVersion) {
    return DataLoss("codebook of version " + std::to_string(version) + ", this program reads " +
                    std::to_string(kVersion));
  }
  const std::string checksum(bytes.begin() + static_cast<std::ptrdiff_t>(size), bytes.end());
  if (HashBytes(bytes.data(), size) != checksum) return DataLoss("codebook is damaged");
  Codebook codebook;
  uint32_t num_features = 0;
  float scale_exponent = 0, power = 0;
  if (!reader.GetString(&codebook.id) || !reader.Get(&num_features) ||
      !reader.Get(&scale_exponent) || !reader.Get(&power) || num_features != kVladFeatures ||
      scale_exponent != kVladScaleExponent || power != kVladPower) {
    return DataLoss("codebook for descriptors that are aggregated in another way");
  }
  if (!GetVector(&reader, &codebook.mean) || !GetMatrix(&reader, &codebook.projection) ||
      !GetMatrix(&reader, &codebook.centres) || !GetMatrix(&reader, &codebook.cell_axes) ||
      !GetVector(&reader, &codebook.photo_mean) || reader.remaining() != 0 ||
      !FitTogether(codebook)) {
    return DataLoss("codebook's matrices do not fit together");
  }
  return codebook;
}

Result<Codebook> LoadCodebook(const std::string& path) {
  const auto bytes = ReadFile(path);
  if (!bytes) return bytes.status();
  auto codebook = DecodeCodebook(*bytes);
  if (!codebook) return codebook.status().Within(path);
  return codebook;
}

Codebook CodebookOf(const std::string& path) {
  auto codebook = LoadCodebook(path.empty() ? ShippedPath() : path);
  if (!codebook) {
    throw std::invalid_argument(codebook.error() +
                                "; name a codebook with --codebook (scripts/train_codebook.sh)");
  }
  return std::move(*codebook);
}

Matrix ProjectDescriptors(const Codebook& codebook, const uint8_t* descriptors, size_t n) {
  using Uint8Matrix = Eigen::Matrix<uint8_t, Eigen::Dynamic, kDescriptorDim, Eigen::RowMajor>;
  const auto rows = static_cast<Eigen::Index>(n);
  Matrix unit = Eigen::Map<const Uint8Matrix>(descriptors, rows, kDescriptorDim).cast<float>();
  unit.rowwise().normalize();
  unit.rowwise() -= codebook.mean.transpose();
  return unit * codebook.projection.transpose();
}

std::vector<int> NearestCentres(const Matrix& points, const Matrix& centres) {
  // |p - c|^2 = |p|^2 - 2 pc + |c|^2, and |p| does not matter.
  const Eigen::RowVectorXf half_norms = centres.rowwise().squaredNorm().transpose() / 2;
  const Matrix scores = (points * centres.transpose()).rowwise() - half_norms;
  std::vector<int> nearest(points.rows());
  for (Eigen::Index i = 0; i < points.rows(); ++i) scores.row(i).maxCoeff(&nearest[i]);
  return nearest;
}

}  // namespace skein
