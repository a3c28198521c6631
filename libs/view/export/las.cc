#include "export/las.h"

#include <geotiff/geo_simpletags.h>
#include <geotiff/geotiffio.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <string>

#include "core/bytes.h"
#include "core/file.h"
#include "export/local_projection.h"

namespace skein {
namespace {

// LAS 1.2, tables 3, 7 and 10.
constexpr uint16_t kLasHeaderBytes = 227, kPointBytes = 26;
constexpr uint8_t kPointFormat = 2;
constexpr uint8_t kOnlyReturn = 1 | 1 << 3;  // the first of one
constexpr uint16_t kGeoKeyDirectory = 34735, kGeoDoubles = 34736;

constexpr double kMillimetre = 0.001;
constexpr double kStepsOfExtent = 1e6;
constexpr uint16_t kSixteenBits = 257;  // 255 becomes 65535

struct LasGrid {
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();
  double scale = 0;
  Eigen::Vector3d low = Eigen::Vector3d::Zero(), high = Eigen::Vector3d::Zero();  // of the points
};

// nullopt: the extent has more steps than 32 bits count.
std::optional<LasGrid> GridOf(const std::vector<LasPoint>& points, double up, bool is_on_earth) {
  Eigen::Vector3d low = points[0].position, high = low;
  for (const LasPoint& point : points) {
    low = low.cwiseMin(point.position);
    high = high.cwiseMax(point.position);
  }
  const double extent = std::max((high - low).maxCoeff(), 1e-30);
  LasGrid grid;
  grid.low = low + Eigen::Vector3d(0, 0, up);
  grid.high = high + Eigen::Vector3d(0, 0, up);
  grid.scale =
      is_on_earth ? kMillimetre : std::pow(10, std::floor(std::log10(extent / kStepsOfExtent)));
  grid.offset = (grid.low + grid.high) / 2;
  if (is_on_earth) grid.offset = grid.offset.array().floor();
  // The centre lies within a metre of the offset: half of the range is enough for each side.
  if (!(extent / grid.scale < std::numeric_limits<int32_t>::max())) return std::nullopt;
  return grid;
}

// A text in a field of `size` bytes.
void PutField(std::string text, size_t size, ByteWriter* writer) {
  text.resize(size);
  writer->PutRaw(text.data(), size);
}

void PutVector(const Eigen::Vector3d& v, ByteWriter* writer) {
  for (int i = 0; i < 3; ++i) writer->Put(v[i]);
}

// A variable length record of what GeoTIFF has in a tag.
Status PutRecord(ST_TIFF* tags, uint16_t tag, size_t value_bytes, ByteWriter* writer) {
  int count = 0, type = 0;
  void* values = nullptr;
  if (ST_GetKey(tags, tag, &count, &type, &values) == 0) {
    return Unavailable("libgeotiff has no tag " + std::to_string(tag));
  }
  const size_t size = static_cast<size_t>(count) * value_bytes;
  writer->Put(uint16_t{0});
  PutField("LASF_Projection", 16, writer);
  writer->Put(tag);
  writer->Put(static_cast<uint16_t>(size));
  PutField("GeoKeys", 32, writer);
  writer->PutRaw(values, size);
  return Status::Ok();
}

Status PutProjection(const GeodeticPosition& origin, ByteWriter* writer) {
  const std::unique_ptr<ST_TIFF, void (*)(ST_TIFF*)> tags(ST_Create(), ST_Destroy);
  const std::unique_ptr<GTIF, void (*)(GTIF*)> keys(GTIFNewSimpleTags(tags.get()), GTIFFree);
  if (keys == nullptr) return Unavailable("libgeotiff does not start");
  SetLocalProjection(origin, keys.get());
  if (GTIFWriteKeys(keys.get()) == 0) return Unavailable("libgeotiff writes no keys");
  Status put = PutRecord(tags.get(), kGeoKeyDirectory, sizeof(uint16_t), writer);
  if (put.ok()) put = PutRecord(tags.get(), kGeoDoubles, sizeof(double), writer);
  return put;
}

void PutHeader(const LasGrid& grid, uint32_t num_points, uint32_t num_records,
               uint32_t records_bytes, ByteWriter* writer) {
  writer->PutRaw("LASF", 4);
  PutField("", 20, writer);  // source, encoding and project identifier
  writer->Put(uint8_t{1});
  writer->Put(uint8_t{2});
  PutField("Skein", 32, writer);
  PutField("Skein", 32, writer);
  PutField("", 4, writer);  // no date
  writer->Put(kLasHeaderBytes);
  writer->Put(kLasHeaderBytes + records_bytes);
  writer->Put(num_records);
  writer->Put(kPointFormat);
  writer->Put(kPointBytes);
  for (const uint32_t count : {num_points, num_points, 0U, 0U, 0U, 0U}) writer->Put(count);
  PutVector(Eigen::Vector3d::Constant(grid.scale), writer);
  PutVector(grid.offset, writer);
  for (int i = 0; i < 3; ++i) {
    writer->Put(grid.high[i]);
    writer->Put(grid.low[i]);
  }
}

void PutPoint(const LasPoint& point, double up, const LasGrid& grid, ByteWriter* writer) {
  const Eigen::Vector3d position = point.position + Eigen::Vector3d(0, 0, up);
  for (int i = 0; i < 3; ++i) {
    writer->Put(static_cast<int32_t>(std::lround((position[i] - grid.offset[i]) / grid.scale)));
  }
  writer->Put(uint16_t{0});  // intensity
  writer->Put(kOnlyReturn);
  PutField("", 5, writer);  // class, scan angle, user's, source
  for (int c = 0; c < 3; ++c) {
    writer->Put(static_cast<uint16_t>(kSixteenBits * point.colour[2 - c]));
  }
}

}  // namespace

Status WriteLas(const std::vector<LasPoint>& points, const std::optional<GeodeticPosition>& origin,
                const std::filesystem::path& file) {
  if (points.empty()) return FailedPrecondition("no points for " + file.string());
  const double up = origin ? origin->altitude_m.value_or(0) : 0;
  const std::optional<LasGrid> grid = GridOf(points, up, origin.has_value());
  if (!grid) return InvalidArgument("points are too far apart for " + file.string());
  if (points.size() > std::numeric_limits<uint32_t>::max()) {
    return InvalidArgument("too many points for " + file.string());
  }
  ByteWriter projection;
  Status status = origin ? PutProjection(*origin, &projection) : Status::Ok();
  if (!status.ok()) return status.Within(file.string());
  const Bytes records = projection.Take();
  ByteWriter writer;
  PutHeader(*grid, static_cast<uint32_t>(points.size()), origin ? 2 : 0,
            static_cast<uint32_t>(records.size()), &writer);
  writer.PutRaw(records.data(), records.size());
  for (const LasPoint& point : points) PutPoint(point, up, *grid, &writer);
  return WriteFileAtomic(file.string(), writer.Take());
}

}  // namespace skein
