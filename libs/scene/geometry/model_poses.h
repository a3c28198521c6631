// Camera poses by name, from the files that models and ground truths come in. Damaged files are
// errors, never aborts (COLMAP's own readers abort).
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/result.h"
#include "geometry/sim3_similarity.h"

namespace skein {

struct NamedPose {
  std::string name;  // as the file has it: AGENT/NAME in Skein's models
  CameraPose pose;   // cam_from_world
};

// Figures of a model's points3D file; zeros without one.
struct PointStatistics {
  size_t points = 0;
  double mean_reprojection_error_px = 0;  // over points, as COLMAP's model_analyzer has it
  double mean_track_length = 0;
};

struct ModelPoses {
  std::vector<NamedPose> poses;
  PointStatistics points;
  bool numbered = false;  // names are numbers (TUM time stamps): match by order
};

// Reads any of these; the error says what was found instead:
//  - a COLMAP model: a folder with images.bin or images.txt, points optional;
//  - a folder of Strecha NAME.camera files;
//  - Middlebury's *_par.txt;
//  - TUM lines: time or name, tx ty tz, qx qy qz qw, the pose of the camera in the world.
Result<ModelPoses> ReadPoses(const std::filesystem::path& path);

Result<ModelPoses> ReadColmapPoses(const std::filesystem::path& folder);
Result<ModelPoses> ReadStrechaPoses(const std::filesystem::path& folder);
Result<ModelPoses> ReadMiddleburyPoses(const std::filesystem::path& file);
Result<ModelPoses> ReadTumPoses(const std::filesystem::path& file);

}  // namespace skein
