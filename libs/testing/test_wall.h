// For tests: a textured wall, photographed from a row of viewpoints, as the shape that its mapper
// publishes. The unit of the photos' depth is that of wall_photos.h times `scale`.
#pragma once

#include <memory>
#include <opencv2/imgproc.hpp>
#include <random>
#include <vector>

#include "formats/shape.h"
#include "sfm/camera.h"
#include "shapes/shape_store.h"
#include "testing/wall_photos.h"

namespace skein {

class TestWall {
 public:
  explicit TestWall(depth_test::Wall wall = {}) : wall_(wall) {}

  // From (x, 0, 0), straight ahead.
  uint32_t Photograph(double x) {
    poses_.push_back(depth_test::PoseAt({x, 0, 0}));
    return static_cast<uint32_t>(poses_.size());
  }
  void Walk(int count) {
    for (int i = 0; i < count; ++i) Photograph(1.5 * i);
  }

  cv::Mat3b Picture(uint32_t image_id) const {
    cv::Mat3b picture;
    cv::cvtColor(wall_.Photo(poses_[image_id - 1]).grey, picture, cv::COLOR_GRAY2BGR);
    return picture;
  }

  // `turn_rad` and `scale`: of the submap's frame, to the wall's.
  ShapePtr MakeShape(int64_t submap_id, uint64_t version, double scale = 1,
                     double turn_rad = 0) const {
    const Eigen::Matrix3d turn = depth_test::PoseAt({0, 0, 0}, turn_rad).rotation;
    auto shape = std::make_shared<Shape>();
    shape->submap_id = submap_id;
    shape->version = version;
    const DepthCamera camera = depth_test::WallCamera();
    const std::vector<double> params = {camera.focal_px.x(), camera.focal_px.y(),
                                        camera.principal_point_px.x(),
                                        camera.principal_point_px.y()};
    shape->cameras = {{1, static_cast<uint64_t>(camera.width), static_cast<uint64_t>(camera.height),
                       params[0], params[1], params[2], params[3], kPinhole, params}};
    for (size_t i = 0; i < poses_.size(); ++i) {
      const Eigen::Quaterniond q(poses_[i].rotation * turn.transpose());
      const Eigen::Vector3d t = scale * poses_[i].translation;
      shape->photos.push_back(
          {static_cast<uint32_t>(i + 1), 1, {q.w(), q.x(), q.y(), q.z()}, {t.x(), t.y(), t.z()}});
    }
    AddPoints(camera, scale, turn, version, shape.get());
    return shape;
  }

  // The distance of a point in the wall's frame from the wall, along z, part of the wall's
  // distance.
  double Error(const Eigen::Vector3d& point) const {
    return (wall_.distance + wall_.slope * point.x() - point.z()) / wall_.distance;
  }
  const DepthPose& Pose(uint32_t image_id) const { return poses_[image_id - 1]; }

 private:
  void AddPoints(const DepthCamera& camera, double scale, const Eigen::Matrix3d& turn,
                 uint64_t version, Shape* shape) const {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> x(-6, 16), y(-4, 4);
    ShapeChunk chunk;
    chunk.version = version;
    chunk.step = scale / 1000;
    chunk.origin = {-32 * scale, -32 * scale, -32 * scale};
    PointTracks tracks;
    for (int i = 0; i < 1500; ++i) {
      Eigen::Vector3d point(x(random), y(random), 0);
      point.z() = wall_.distance + wall_.slope * point.x();
      std::vector<PointObservation> seen;
      for (size_t k = 0; k < poses_.size(); ++k) {
        const Eigen::Vector3d in_camera = poses_[k].rotation * point + poses_[k].translation;
        const Eigen::Vector2d pixel = camera.Pixel(in_camera.hnormalized());
        if (pixel.minCoeff() > 0 && pixel.x() < camera.width && pixel.y() < camera.height) {
          seen.push_back({static_cast<uint32_t>(k + 1), static_cast<uint32_t>(i)});
        }
      }
      if (seen.size() < 2) continue;
      ShapePoint packed;
      const Eigen::Vector3d placed = scale * (turn * point);
      for (int axis = 0; axis < 3; ++axis) {
        packed.xyz[axis] =
            static_cast<uint16_t>(std::lround((placed[axis] - chunk.origin[axis]) / chunk.step));
      }
      chunk.points.push_back(packed);
      tracks.observations.insert(tracks.observations.end(), seen.begin(), seen.end());
      tracks.ends.push_back(static_cast<uint32_t>(tracks.observations.size()));
    }
    const Bytes bytes = EncodePointTracks(tracks);
    shape->chunks = {{1, version, static_cast<uint32_t>(chunk.points.size()),
                      std::make_shared<const Bytes>(EncodeShapeChunk(chunk)),
                      std::make_shared<const Bytes>(bytes), "", bytes.size()}};
  }

  depth_test::Wall wall_;
  std::vector<DepthPose> poses_;
};

}  // namespace skein
