// Depth maps of all photos of a model, and the depths that they agree on.
#pragma once

#include <cstdint>
#include <functional>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "core/result.h"
#include "depth/dense_points.h"
#include "depth/depth_map.h"
#include "depth/depth_scene.h"
#include "depth/depth_sweep.h"
#include "depth/neighbours.h"

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

// KeepAgreed (consistency.h) of each map with those that `confirming` names, on all cores.
std::vector<DepthMap> AgreedMaps(const std::vector<DepthMap>& maps,
                                 const std::vector<std::vector<int>>& confirming);

double MeanCompleteness(const std::vector<DepthMap>& maps);

struct ModelDepths {
  std::vector<DepthMap> maps;  // agreed depths of the scene's photos
  std::vector<cv::Mat3b> colours;
  std::vector<std::vector<int>> confirming;

  // PointsOf (dense_points.h) of each map, on all cores.
  std::vector<std::vector<DensePoint>> Points() const;
};

// All of the above, on all cores. Takes 19 bytes a pixel of all depth maps, and up to 2 GiB for the
// sweeps. on_photo: after each photo, from any thread. Errors: as ReadDepthInput.
Result<ModelDepths> MakeModelDepths(const DepthScene& scene, int size_px, const ScenePhoto& photo,
                                    const std::function<void()>& on_photo);

}  // namespace skein
