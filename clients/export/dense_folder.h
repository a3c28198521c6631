// Depth maps of a model's photos, and the dense points that they agree on.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <set>
#include <string>

#include "clients/export/photo_source.h"
#include "core/result.h"
#include "sfm/reconstruction.h"

namespace skein {

inline constexpr char kDepth[] = "depth";
inline constexpr char kDense[] = "dense";

struct DenseFigures {
  int64_t num_points = 0;
  double completeness = 0;  // share of the photos' pixels that have a depth
};

// Makes a depth map of each registered photo, its longer side `size_px` or the photo's, and keeps
// the depths that two other maps agree with (depth/consistency.h). Writes for the formats
//  - "dense": dense.ply, points with normals and colours in the model's frame, binary;
//  - "depth": in depth/, of each photo NAME.png (16 bit), NAME.pfm and NAME.error.pfm, and
//    cameras.json with scale, intrinsics and pose of each. docs/exchange.md describes them.
// Takes 19 bytes a pixel of all depth maps, and up to 2 GiB while maps are made. on_photo: after
// each photo, from any thread. `folder` must exist. Error: a photo cannot be read or has another
// size than its camera, or a file cannot be written; the folder is then incomplete.
Result<DenseFigures> WriteDenseFolder(const Reconstruction& model,
                                      const std::set<std::string>& formats, int size_px,
                                      const PhotoSource& photos,
                                      const std::function<void()>& on_photo,
                                      const std::filesystem::path& folder);

}  // namespace skein
