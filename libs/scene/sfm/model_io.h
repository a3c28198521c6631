#pragma once

#include <string>
#include <vector>

#include "core/result.h"
#include "formats/formats.h"
#include "sfm/reconstruction.h"

namespace skein {

// cameras.bin, images.bin, points3D.bin as COLMAP 3.8 writes them, in memory and ordered by id, so
// that equal models are equal bytes: registered images only, and cameras that they use.
ModelArchive EncodeModel(const Reconstruction& reconstruction);

// The reverse. Every count, id and index is checked, as COLMAP aborts the process on bad ones. The
// points get new ids, in the order of the file. Fails on a missing or damaged file.
Result<Reconstruction> DecodeModel(const ModelArchive& archive);
// The same; each file is freed once it is read.
Result<Reconstruction> DecodeModel(ModelArchive&& archive);

// Ids of the cameras that registered images use, and of all points; ascending.
std::vector<CameraId> UsedCameras(const Reconstruction& reconstruction);
std::vector<Point3DId> AscendingPoints(const Reconstruction& reconstruction);
// Whether its id is new, and its sides and parameters can be a camera's.
bool CanBeAdded(const Reconstruction& reconstruction, const Camera& camera);
// Whether its id is new, its camera is there, it has a pose, and its name is one (IsImageName).
bool CanBeAdded(const Reconstruction& reconstruction, const Image& image);
// Whether the track's elements are keypoints of the model that observe no point, none of them
// twice. O(n log n) for n elements: files of others may hold a track of millions.
bool CanBeAdded(const Reconstruction& reconstruction, const Track& track);
// Whether the name leads to a file below a folder: UTF-8 without control characters, no absolute
// path, no empty part, "." or "..". Exports hand names on to programs that read and
// write by them.
bool IsImageName(const std::string& name);

// Id, camera, name, pose and keypoints. The copy is not registered.
Image WithoutPoints(const Image& image);

// Same result as encoding and decoding, without either: the registered images and their cameras;
// the points get new ids, in the order of the old ones.
Reconstruction CopyRegistered(const Reconstruction& reconstruction);

}  // namespace skein
