// Dense points of a submap for the live view: a list of chunks, each of one photo. A chunk is that
// of a map snapshot (formats/shape.h), in another frame.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/bytes.h"
#include "core/result.h"

namespace skein {

// `scale` times a chunk's points lie in the photo's camera frame, in the submap's unit: x right, y
// down, z forward. So a bundle adjustment and a merge change no chunk: the photo's pose in the
// newest map snapshot leads to the submap's frame. num_photos of a ShapePoint is the confidence:
// 255 (1 - e / 1 %), at least 0; e: predicted standard error of the depth, part of the depth.
struct DenseManifest {
  struct Chunk {
    uint64_t id = 0;  // one of the submap's
    uint64_t version = 0;
    uint32_t num_points = 0;
    std::string points_blob;  // EncodeShapeChunk
  };
  struct Photo {
    uint32_t image_id = 0;
    double scale = 1;
    float share = 0;  // of the depth map's pixels that are a point
    std::vector<Chunk> chunks;
  };

  uint64_t version = 0;  // microseconds since 1970, and above that of any earlier one
  std::vector<Photo> photos;

  int64_t NumPoints() const;
};

Bytes EncodeDenseManifest(const DenseManifest& manifest);
// Error, too, where a number makes no sense: a scale that is not above 0, a chunk of more than
// ShapeChunk::kMaxPoints.
Result<DenseManifest> DecodeDenseManifest(const Bytes& bytes);

}  // namespace skein
