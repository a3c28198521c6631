#include "dense/dense_options.h"

#include <CLI/CLI.hpp>

#include "core/option_check.h"

namespace skein {

Status DenseOptions::Check() const {
  return FirstError({InRange("size", size_px, 64, 4096),
                     InRange("memory", memory_mib, 16, 1'000'000),
                     InRange("surface-memory", surface_memory_mib, 0, 1'000'000)});
}

void AddOptions(CLI::App& app, DenseOptions* options) {
  app.add_option("--size", options->size_px, "Longer side of a depth map, pixels");
  app.add_option("--memory", options->memory_mib,
                 "MiB of depth maps and their photos that are kept; dense points stay");
  app.add_option(
      "--surface-memory", options->surface_memory_mib,
      "MiB for the mesh's voxels and depth maps; beyond it voxels become coarser; 0: no mesh");
  app.add_option("--decoder", options->decoder.program,
                 "Program that decodes photos; default: skein-decoder beside this program");
}

}  // namespace skein
