// Frames of an RGB-D camera as a scene whose depths are known: FRAME.color.jpg, FRAME.depth.png (16
// bit, millimetres; 0 and 65535: none) and FRAME.pose.txt (camera to world, metres) of a folder.
#pragma once

#include <opencv2/core.hpp>
#include <string>

#include "depth/depth_scene.h"

namespace skein {

// The depth camera's focal length is known; the poses are its own. The colour camera looks the same
// way from beside it.
struct RgbdRig {
  double depth_focal_px = 585;
  double colour_focal_px = 525;
  double colour_offset_m = 0.025;  // of the colour camera along x of the depth camera
};

// A photo as it is stored. Throws std::runtime_error.
cv::Mat3b ReadPhoto(const std::string& path);

// Points are depths of a grid of pixels; a photo observes those that its own depths confirm. Throws
// std::runtime_error without frames.
DepthScene ReadRgbdScene(const std::string& folder, const RgbdRig& rig);

// The frame's depths as its colour camera has them, 0 where there is none.
cv::Mat1f RgbdTruth(const std::string& folder, const std::string& colour_name, const RgbdRig& rig,
                    const DepthCamera& colour);

// Mean absolute difference of grey values between each frame and the one `step` later, at true
// points: least where the rig is right.
double RgbdGreyDifference(const std::string& folder, const RgbdRig& rig, int step);

}  // namespace skein
