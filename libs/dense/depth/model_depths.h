// Depth maps of all photos of a model, and the depths that they agree on.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "core/result.h"
#include "depth/dense_points.h"
#include "depth/depth_map.h"
#include "depth/depth_quality.h"
#include "depth/depth_scene.h"
#include "depth/depth_sweep.h"
#include "depth/neighbours.h"
#include "depth/scratch_file.h"

namespace skein {

// Photo i of a scene, 8-bit BGR, of its lens' size. Valid until the next call.
using ScenePhoto = std::function<Result<cv::Mat3b>(size_t i)>;

// The photos of a scene as they go into the sweeps. Index: that of the scene's photos.
struct DepthInput {
  std::vector<DepthPhoto> photos;
  std::vector<cv::Mat3b> colours;                 // of the photos' pixels
  std::vector<std::vector<int>> neighbours;       // best first
  std::vector<std::optional<DepthRange>> ranges;  // nullopt: no depth is searched

  // The neighbours of each photo, and the photos whose neighbour it is: the maps that may agree
  // with its own. Any two maps meet both ways.
  std::vector<std::vector<int>> Confirming() const;
};

// size_px: longer side of a depth map; a smaller photo keeps its own. Error: a photo cannot be
// read. Throws std::invalid_argument for a photo of another size.
Result<DepthInput> ReadDepthInput(const DepthScene& scene, int size_px, const ScenePhoto& photo);

// The map of photo `index`, matched with its first kNumMatched neighbours.
DepthMap SweepPhoto(const DepthInput& input, size_t index, DepthSweep* sweep);

// Maps of sweeps, checked by each other.
struct CheckedDepths {
  std::vector<DepthMap> maps;       // agreed depths, without the contradicted ones
  std::vector<cv::Mat1b> masks;     // StaticMask (consistency.h) of each map
  std::vector<DepthCounts> counts;  // of the depths before the check
};

// Each map is checked by those that `confirming` names, on all cores.
CheckedDepths CheckDepths(const std::vector<DepthMap>& maps,
                          const std::vector<std::vector<int>>& confirming);

double MeanCompleteness(const std::vector<DepthMap>& maps);

// The depths of a scene's photos.
struct ModelDepths : CheckedDepths {
  std::unique_ptr<ScratchFile> file;  // holds the pixels of `maps`, `masks` and `colours`
  std::vector<cv::Mat3b> colours;
  std::vector<std::vector<int>> confirming;

  // PointsOf (dense_points.h) of each map, on all cores.
  std::vector<std::vector<DensePoint>> Points() const;
};

// All of the above, on all cores. Takes up to 2 GiB of memory for the sweeps. Pixels lie in files
// without a name in `folder`: 21 bytes a pixel of all depth maps and 1 a pixel of each camera, of
// which the result keeps 12 a pixel. on_photo: after each photo, from any thread. Errors: as
// ReadDepthInput and ScratchFile::Make, which comes before the first photo is read.
Result<ModelDepths> MakeModelDepths(const DepthScene& scene, int size_px, const ScenePhoto& photo,
                                    const std::function<void()>& on_photo,
                                    const std::filesystem::path& folder);

}  // namespace skein
