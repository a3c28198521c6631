#include "depth/depth_map.h"

#include <algorithm>
#include <iterator>

#include "core/statistics.h"

namespace skein {
namespace {

bool HasSize(const cv::Mat& pixels, const DepthCamera& camera) {
  return pixels.cols == camera.width && pixels.rows == camera.height;
}

}  // namespace

bool IsSound(const DepthPhoto& photo) {
  const DepthCamera& camera = photo.camera;
  return camera.width > 0 && camera.height > 0 && HasSize(photo.grey, camera) &&
         (photo.valid.empty() || HasSize(photo.valid, camera)) && camera.focal_px.minCoeff() > 0 &&
         camera.focal_px.allFinite() && camera.principal_point_px.allFinite() &&
         photo.cam_from_world.rotation.allFinite() && photo.cam_from_world.translation.allFinite();
}

DepthMap HolesOf(const DepthPhoto& photo) {
  const cv::Size size = photo.grey.size();
  return {photo.camera, photo.cam_from_world, cv::Mat1f(size, 0.0f), cv::Mat1f(size, 0.0f)};
}

void DepthMap::MakeHoles(const cv::Mat1b& where) {
  depth.setTo(0, where);
  error.setTo(0, where);
}

double DepthMap::Completeness() const {
  return depth.empty() ? 0 : static_cast<double>(cv::countNonZero(depth)) / depth.total();
}

double DepthMap::MedianDepth() const {
  std::vector<double> depths;
  std::copy_if(depth.begin(), depth.end(), std::back_inserter(depths),
               [](float one) { return one > 0; });
  return UpperMedian(std::move(depths));
}

}  // namespace skein
