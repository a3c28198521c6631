// Map snapshot (shape) for the live view: chunks of coloured points, their observers, and the list
// of chunks. Encodings as in formats.h, but for a chunk, which a browser reads
// (services/web/README.md).
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "core/bytes.h"
#include "core/result.h"

namespace skein {

// A point of a chunk: position = origin + step * xyz, in the submap's frame.
struct ShapePoint {
  std::array<uint16_t, 3> xyz{};
  std::array<uint8_t, 3> rgb{};
  uint8_t num_photos = 0;  // that see it, at most 255
};

struct ShapeChunk {
  static constexpr uint32_t kMaxPoints = 16384;

  std::array<double, 3> origin{};
  double step = 0;
  uint64_t version = 0;
  std::vector<ShapePoint> points;
};

// "SKC1", uint32 number of points, 3 float64 origin, float64 step, uint64 version; 10 bytes a
// point.
constexpr size_t kShapeChunkHeaderBytes = 48, kShapePointBytes = 10;
Bytes EncodeShapeChunk(const ShapeChunk& chunk);
Result<ShapeChunk> DecodeShapeChunk(const Bytes& bytes);

// Observations of a chunk's points, in the order of the points.
struct PointObservation {
  uint32_t image_id = 0;
  uint32_t point2D_idx = 0;  // keypoint index
};
struct PointTracks {
  std::vector<uint32_t> ends;  // of point i: observations from ends[i - 1] (0 for i = 0) to ends[i]
  std::vector<PointObservation> observations;
};

Bytes EncodePointTracks(const PointTracks& tracks);
Result<PointTracks> DecodePointTracks(const Bytes& bytes);

struct ShapePhoto {
  uint32_t image_id = 0;
  uint32_t camera_id = 0;
  std::array<double, 4> qvec{1, 0, 0, 0};  // cam_from_world, wxyz
  std::array<double, 3> tvec{};

  bool operator==(const ShapePhoto& other) const {
    return image_id == other.image_id && camera_id == other.camera_id && qvec == other.qvec &&
           tvec == other.tvec;
  }
};

struct ShapeCamera {
  uint32_t camera_id = 0;
  uint64_t width = 0, height = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;
  // The same with the lens distortion: COLMAP's id of the camera model, and its parameters.
  int32_t model_id = -1;
  std::vector<double> params = {};

  bool operator==(const ShapeCamera& other) const {
    return camera_id == other.camera_id && width == other.width && height == other.height &&
           fx == other.fx && fy == other.fy && cx == other.cx && cy == other.cy &&
           model_id == other.model_id && params == other.params;
  }
};

// Map snapshot (shape) as a mapper publishes it; the bytes of chunks are blobs of their own.
struct ShapeManifest {
  struct Chunk {
    uint64_t id = 0;
    uint64_t version = 0;
    uint32_t num_points = 0;
    std::string points_blob;  // EncodeShapeChunk
    std::string tracks_blob;  // EncodePointTracks
    uint64_t tracks_bytes = 0;
  };

  uint64_t version = 0;  // microseconds since 1970, and above that of any earlier shape
  std::vector<ShapePhoto> photos;
  std::vector<ShapeCamera> cameras;
  std::vector<Chunk> chunks;
};

Bytes EncodeShapeManifest(const ShapeManifest& manifest);
Result<ShapeManifest> DecodeShapeManifest(const Bytes& bytes);

}  // namespace skein
