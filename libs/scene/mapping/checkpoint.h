#pragma once

#include <cstdint>
#include <vector>

#include "core/result.h"
#include "formats/formats.h"
#include "mapping/submap.h"

namespace skein {

// A submap as a model archive: COLMAP's three files, and state.bin with the rest (SubmapState).
// Any reader of COLMAP models takes the three files.
ModelArchive SaveSubmap(Submap* submap);

// The photos that the archive holds, registered or waiting, in the order they came. All photos must
// be in a submap before the archive is restored into it. Fails on a damaged state.bin.
Result<std::vector<int64_t>> PhotosOfArchive(const ModelArchive& archive);

// Restores into a submap that has the archive's photos with their pairs and nothing registered.
Status RestoreSubmap(const ModelArchive& archive, Submap* submap);

}  // namespace skein
