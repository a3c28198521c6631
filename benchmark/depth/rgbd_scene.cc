#include "benchmark/depth/rgbd_scene.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

namespace skein {
namespace {

constexpr int kGridPx = 24;          // between points
constexpr double kSameDepth = 0.02;  // part of the depth
const std::string kColour = ".color.jpg";

struct Frame {
  std::string name;  // of the colour photo
  cv::Mat1f depth;   // metres, 0: none
  DepthPose pose;    // of the depth camera
};

std::string Stem(const std::string& colour_name) {
  return colour_name.substr(0, colour_name.size() - kColour.size());
}

cv::Mat1f ReadDepth(const std::string& file) {
  const cv::Mat raw = cv::imread(file, cv::IMREAD_ANYDEPTH);
  if (raw.type() != CV_16U) throw std::runtime_error(file + " is no depth image");
  cv::Mat1f depth;
  raw.convertTo(depth, CV_32F, 1e-3);
  depth.setTo(0, raw == 65535);
  return depth;
}

DepthPose ReadPose(const std::string& file) {
  std::ifstream in(file);
  Eigen::Matrix4d m;
  for (int i = 0; i < 16; ++i) in >> m(i / 4, i % 4);
  if (!in) throw std::runtime_error(file + " is no pose");
  const Eigen::Matrix3d rotation = m.topLeftCorner<3, 3>().transpose();
  return {rotation, -rotation * m.topRightCorner<3, 1>()};
}

std::vector<Frame> ReadFrames(const std::string& folder) {
  std::vector<Frame> frames;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (name.size() <= kColour.size() || name.substr(Stem(name).size()) != kColour) continue;
    const std::string stem = folder + "/" + Stem(name);
    frames.push_back({name, ReadDepth(stem + ".depth.png"), ReadPose(stem + ".pose.txt")});
  }
  if (frames.empty()) throw std::runtime_error(folder + " has no frames");
  std::sort(frames.begin(), frames.end(),
            [](const Frame& a, const Frame& b) { return a.name < b.name; });
  return frames;
}

DepthCamera CameraOf(const cv::Size& size, double focal_px) {
  return {size.width, size.height, {focal_px, focal_px}, {size.width / 2.0, size.height / 2.0}};
}

DepthPose ColourPose(const DepthPose& depth, const RgbdRig& rig) {
  return {depth.rotation, depth.translation - Eigen::Vector3d(rig.colour_offset_m, 0, 0)};
}

LensCamera PinholeLens(const DepthCamera& camera) {
  return {camera.width, camera.height, camera.focal_px, camera.principal_point_px,
          [camera](const Eigen::Vector2d& ray) {
            return std::optional<Eigen::Vector2d>(camera.Pixel(ray));
          }};
}

Eigen::Vector3d WorldPoint(const Frame& frame, const DepthCamera& camera, int x, int y) {
  const Eigen::Vector3d in_camera =
      frame.depth(y, x) * camera.Ray({x + 0.5, y + 0.5}).homogeneous();
  return frame.pose.rotation.transpose() * (in_camera - frame.pose.translation);
}

bool Confirms(const Frame& frame, const DepthCamera& camera, const Eigen::Vector3d& point) {
  const Eigen::Vector3d p = frame.pose.ToCamera(point);
  if (p.z() <= 0) return false;
  const Eigen::Vector2d pixel = camera.Pixel(p.hnormalized());
  const int x = static_cast<int>(std::floor(pixel.x())),
            y = static_cast<int>(std::floor(pixel.y()));
  if (x < 0 || y < 0 || x >= camera.width || y >= camera.height) return false;
  return std::abs(frame.depth(y, x) - p.z()) < kSameDepth * p.z();
}

}  // namespace

cv::Mat3b ReadPhoto(const std::string& path) {
  const cv::Mat3b photo = cv::imread(path, cv::IMREAD_COLOR | cv::IMREAD_IGNORE_ORIENTATION);
  if (photo.empty()) throw std::runtime_error(path + " is no photo");
  return photo;
}

DepthScene ReadRgbdScene(const std::string& folder, const RgbdRig& rig) {
  const std::vector<Frame> frames = ReadFrames(folder);
  const DepthCamera depth = CameraOf(frames[0].depth.size(), rig.depth_focal_px);
  const LensCamera lens = PinholeLens(CameraOf(frames[0].depth.size(), rig.colour_focal_px));
  DepthScene scene;
  for (const Frame& frame : frames) {
    scene.names.push_back(frame.name);
    scene.lenses.push_back(lens);
    scene.cameras.push_back(0);
    scene.photos.push_back({ColourPose(frame.pose, rig), {}});
    for (int y = kGridPx / 2; y < depth.height; y += kGridPx) {
      for (int x = kGridPx / 2; x < depth.width; x += kGridPx) {
        if (frame.depth(y, x) > 0) scene.points.push_back(WorldPoint(frame, depth, x, y));
      }
    }
  }
  for (size_t i = 0; i < frames.size(); ++i) {
    for (int point = 0; point < static_cast<int>(scene.points.size()); ++point) {
      if (Confirms(frames[i], depth, scene.points[point])) scene.photos[i].points.push_back(point);
    }
  }
  return scene;
}

cv::Mat1f RgbdTruth(const std::string& folder, const std::string& colour_name, const RgbdRig& rig,
                    const DepthCamera& colour) {
  const cv::Mat1f measured = ReadDepth(folder + "/" + Stem(colour_name) + ".depth.png");
  const DepthCamera camera = CameraOf(measured.size(), rig.depth_focal_px);
  cv::Mat1f truth(colour.height, colour.width, 0.0f);
  for (int y = 0; y < measured.rows; ++y) {
    for (int x = 0; x < measured.cols; ++x) {
      const float z = measured(y, x);
      if (!(z > 0)) continue;
      Eigen::Vector3d p = z * camera.Ray({x + 0.5, y + 0.5}).homogeneous();
      p.x() -= rig.colour_offset_m;
      const Eigen::Vector2d pixel = colour.Pixel(p.hnormalized());
      const int u = static_cast<int>(std::floor(pixel.x())),
                v = static_cast<int>(std::floor(pixel.y()));
      if (u < 0 || v < 0 || u >= colour.width || v >= colour.height) continue;
      float& nearest = truth(v, u);
      if (nearest == 0 || z < nearest) nearest = z;
    }
  }
  return truth;
}

double RgbdGreyDifference(const std::string& folder, const RgbdRig& rig, int step) {
  const std::vector<Frame> frames = ReadFrames(folder);
  const DepthCamera depth = CameraOf(frames[0].depth.size(), rig.depth_focal_px);
  const DepthCamera colour = CameraOf(frames[0].depth.size(), rig.colour_focal_px);
  const auto read_grey = [&](const Frame& frame) {
    cv::Mat1b grey;
    cv::cvtColor(ReadPhoto(folder + "/" + frame.name), grey, cv::COLOR_BGR2GRAY);
    return grey;
  };
  double sum = 0;
  size_t count = 0;
  for (size_t i = 0; i + step < frames.size(); i += 3) {
    const cv::Mat1b greys[] = {read_grey(frames[i]), read_grey(frames[i + step])};
    const DepthPose poses[] = {ColourPose(frames[i].pose, rig),
                               ColourPose(frames[i + step].pose, rig)};
    for (int y = 8; y < depth.height; y += 4) {
      for (int x = 8; x < depth.width; x += 4) {
        if (!(frames[i].depth(y, x) > 0)) continue;
        const Eigen::Vector3d point = WorldPoint(frames[i], depth, x, y);
        if (!Confirms(frames[i + step], depth, point)) continue;
        int grey[2] = {-1, -1};
        for (int k = 0; k < 2; ++k) {
          const Eigen::Vector3d p = poses[k].ToCamera(point);
          const Eigen::Vector2d pixel = colour.Pixel(p.hnormalized());
          const int u = static_cast<int>(std::floor(pixel.x())),
                    v = static_cast<int>(std::floor(pixel.y()));
          if (u < 0 || v < 0 || u >= colour.width || v >= colour.height) continue;
          grey[k] = greys[k](v, u);
        }
        if (grey[0] < 0 || grey[1] < 0) continue;
        sum += std::min(std::abs(grey[0] - grey[1]), 40);
        ++count;
      }
    }
  }
  return count == 0 ? 0 : sum / static_cast<double>(count);
}

}  // namespace skein
