#pragma once

#include "base/reconstruction.h"
#include "core/result.h"
#include "formats/formats.h"

namespace skein {

// cameras.bin, images.bin, points3D.bin as COLMAP 3.8 writes them, in memory and ordered by id, so
// that equal models are equal bytes: registered images only, and cameras that they use.
ModelArchive EncodeModel(const colmap::Reconstruction& reconstruction);

// The reverse. Every count, id and index is checked, as COLMAP aborts the process on bad ones. The
// points get new ids, in the order of the file. Fails on a missing or damaged file.
Result<colmap::Reconstruction> DecodeModel(const ModelArchive& archive);
// The same; each file is freed once it is read.
Result<colmap::Reconstruction> DecodeModel(ModelArchive&& archive);

// Same result as encoding and decoding, without either: the registered images and their cameras;
// the points get new ids, in the order of the old ones.
colmap::Reconstruction CopyRegistered(const colmap::Reconstruction& reconstruction);

}  // namespace skein
