#pragma once

#include <filesystem>

#include "core/result.h"
#include "sfm/reconstruction.h"

namespace skein {

// Bundler's v0.3 (cs.cornell.edu/~snavely/bundler/bundler-v0.3-manual.html): cameras and points in
// `file`, photos' names in `list`, in the same order. Cameras look along -z, pixels are from the
// principal point, y up. Error: a camera that ExpectSimpleCamera refuses, or a file that cannot be
// written.
Status WriteBundlerFiles(const Reconstruction& model, const std::filesystem::path& file,
                         const std::filesystem::path& list);

}  // namespace skein
