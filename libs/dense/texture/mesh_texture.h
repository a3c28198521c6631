// A mesh with its photos as textures.
//
// Triangles that touch and take one photo are a chart. A chart's texture is the part of the photo
// that shows it, so texture coordinates are the photo's pixels. Charts lie side by side on pages.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <opencv2/core.hpp>
#include <vector>

#include "core/result.h"
#include "core/threads.h"
#include "depth/coloured_map.h"
#include "surface/surface_mesh.h"

namespace skein {

// Triangles of a mesh that have one texture, or none.
struct MeshPart {
  cv::Mat3b texture;               // blue, green, red; empty: the colours of the mesh's vertices
  std::vector<uint32_t> vertices;  // of the mesh; one with two places in textures stands twice
  std::vector<Eigen::Vector2f> places;  // of each vertex in the texture: (0, 0) is its upper left
                                        // corner, (1, 1) its lower right; empty without a texture
  std::vector<uint32_t> indices;        // of `vertices`, as SurfaceMesh::indices
};

// The photos that the depth maps are of, freed of their distortion, as large as they are.
struct TexturePhotos {
  std::vector<DepthCamera> cameras;                       // of each photo
  std::function<Result<cv::Mat3b>(size_t photo)> pixels;  // asked for once each, ascending
};

struct TextureOptions {
  int page_px = 4096;               // side of a texture at most
  int64_t max_pixels = 64'000'000;  // of all textures, gaps not counted; else photos are reduced
  int num_threads = NumHardwareThreads();
};

// Parts that hold each triangle once; the last one may have no texture: its triangles are shown by
// no photo. Error: a photo cannot be read. Throws std::invalid_argument if the numbers of maps and
// cameras differ.
Result<std::vector<MeshPart>> TextureOf(const SurfaceMesh& mesh,
                                        const std::vector<ColouredMap>& maps,
                                        const TexturePhotos& photos,
                                        const TextureOptions& options = {});

}  // namespace skein
