// Dense points and the mesh of a submap for the live view: lists of chunks. A chunk of points is
// that of a map snapshot (formats/shape.h), in the frame of one photo; a chunk of the mesh is a
// MeshChunk (formats/mesh_chunk.h).
#pragma once

#include <array>
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

  // Chunks of the mesh lie in the submap's frame as it was when they were made: there, the photos
  // of `frame` had these poses. The photos' poses in the newest map snapshot tell what moved.
  struct Mesh {
    struct Chunk {
      uint64_t id = 0;  // one of the submap's
      uint64_t version = 0;
      uint32_t num_vertices = 0, num_triangles = 0;
      std::string blob;  // EncodeMeshChunk
    };
    struct FramePhoto {
      uint32_t image_id = 0;
      std::array<double, 4> qvec{1, 0, 0, 0};  // cam_from_world, wxyz
      std::array<double, 3> tvec{};
    };

    double voxel = 0;  // side, in the submap's unit; 0: no mesh
    std::vector<FramePhoto> frame;
    std::vector<Chunk> chunks;
  };

  uint64_t version = 0;  // microseconds since 1970, and above that of any earlier one
  std::vector<Photo> photos;
  Mesh mesh;

  int64_t NumPoints() const;
  int64_t NumTriangles() const;
};

Bytes EncodeDenseManifest(const DenseManifest& manifest);
// Error, too, where a number makes no sense: a scale that is not above 0, a pose that is not
// finite, a chunk of more than ShapeChunk::kMaxPoints, MeshChunk::kMaxVertices or kMaxTriangles.
Result<DenseManifest> DecodeDenseManifest(const Bytes& bytes);

}  // namespace skein
