#pragma once

#include "core/result.h"
#include "photo/photo_decoder.h"

namespace CLI {
class App;
}

namespace skein {

struct DenseOptions {
  int size_px = 400;      // longer side of a depth map
  int memory_mib = 1024;  // of depth maps and their photos; those used longest ago are forgotten
  int surface_memory_mib = 512;  // of the mesh's voxels and depth maps; 0: no mesh
  DecoderOptions decoder;

  Status Check() const;
};

// [dense] of a config file.
void AddOptions(CLI::App& app, DenseOptions* options);

}  // namespace skein
