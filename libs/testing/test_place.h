// For tests: a wall, photographed by agents, as the shape that its mapper tells. World: z up; the
// wall lies in y = 0 and faces -y. Lengths in submap units.
#pragma once

#include <cmath>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "guide/place_guidance.h"

namespace skein {

class TestPlace {
 public:
  explicit TestPlace(double width = 12, double height = 4, int num_points = 4000) {
    std::mt19937_64 random(7);
    std::uniform_real_distribution<double> unit(0, 1);
    for (int i = 0; i < num_points; ++i) {
      points_.push_back(
          {i, {width * unit(random), 0.02 * unit(random), height * unit(random)}, {}});
    }
  }

  // Level, from (x, -distance, height), turned to the right from straight ahead.
  int64_t Photograph(const std::string& agent, double x, double right_rad = 0, double distance = 5,
                     double height = 2) {
    ShapePhoto photo;
    photo.image_id = static_cast<uint32_t>(photos_.size() + 1);
    photo.camera_id = 1;
    Eigen::Matrix3d rotation;  // rows: x, y, z of the camera
    rotation << std::cos(right_rad), -std::sin(right_rad), 0, 0, 0, -1, std::sin(right_rad),
        std::cos(right_rad), 0;
    const Eigen::Vector3d centre(x, -distance, height), translation = -(rotation * centre);
    const Eigen::Quaterniond quaternion(rotation);
    photo.qvec = {quaternion.w(), quaternion.x(), quaternion.y(), quaternion.z()};
    photo.tvec = {translation.x(), translation.y(), translation.z()};
    photos_.push_back(photo);
    GuidePhoto& known = known_[photo.image_id];
    known.agent = agent;
    known.name = std::to_string(photo.image_id) + ".jpg";
    for (Point& point : points_) {
      const Eigen::Vector3d in_camera = rotation * point.xyz + translation;
      const double u = 1000 * in_camera.x() / in_camera.z() + 600;
      const double v = 1000 * in_camera.y() / in_camera.z() + 450;
      if (in_camera.z() > 0 && u > 0 && u < 1200 && v > 0 && v < 900) {
        point.photos.push_back(photo.image_id);
      }
    }
    return photo.image_id;
  }
  // Photos of one agent along the wall.
  void Walk(const std::string& agent, double from, double to, int count) {
    for (int i = 0; i < count; ++i) Photograph(agent, from + (to - from) * i / (count - 1));
  }
  // GPS of a model whose unit is `metres` and whose x is east.
  void Locate(double metres) {
    for (const ShapePhoto& photo : photos_) {
      const CameraPose pose = PoseOf(photo);
      GuidePhoto& known = known_[photo.image_id];
      known.has_position = true;
      known.position = {48 + metres * pose.Centre().y() / 111'200.0,
                        11 + metres * pose.Centre().x() / (111'320.0 * std::cos(48 * 0.0174533)),
                        500 + metres * pose.Centre().z()};
    }
  }

  static CameraPose PoseOf(const ShapePhoto& photo) {
    CameraPose pose;
    pose.rotation = Eigen::Quaterniond(photo.qvec[0], photo.qvec[1], photo.qvec[2], photo.qvec[3]);
    pose.translation = {photo.tvec[0], photo.tvec[1], photo.tvec[2]};
    return pose;
  }

  // Shape of the points that two photos see, in chunks of 1,000 points.
  std::shared_ptr<Shape> MakeShape(int64_t submap_id, uint64_t version) const {
    constexpr size_t kChunkPoints = 1000;
    auto shape = std::make_shared<Shape>();
    shape->submap_id = submap_id;
    shape->version = version;
    shape->photos = photos_;
    shape->cameras = {{1, 1200, 900, 1000, 1000, 600, 450}};
    ShapeChunk points;
    PointTracks tracks;
    const auto close = [&] {
      if (points.points.empty()) return;
      points.version = version;
      const Bytes bytes = EncodePointTracks(tracks);
      shape->chunks.push_back({shape->chunks.size() + 1, version,
                               static_cast<uint32_t>(points.points.size()),
                               std::make_shared<const Bytes>(EncodeShapeChunk(points)),
                               std::make_shared<const Bytes>(bytes), "", bytes.size()});
      points.points.clear();
      tracks = {};
    };
    points.step = 1.0 / 4096;
    for (const Point& point : points_) {
      if (point.photos.size() < 2) continue;
      ShapePoint shown;
      for (int axis = 0; axis < 3; ++axis) {
        shown.xyz[axis] = static_cast<uint16_t>(std::lround(point.xyz[axis] / points.step));
      }
      points.points.push_back(shown);
      for (const uint32_t photo : point.photos) {
        tracks.observations.push_back({photo, static_cast<uint32_t>(point.index)});
      }
      tracks.ends.push_back(static_cast<uint32_t>(tracks.observations.size()));
      if (points.points.size() == kChunkPoints) close();
    }
    close();
    return shape;
  }
  PlaceInput Input() const {
    PlaceInput input;
    input.shape = MakeShape(3, 10);
    input.photos = known_;
    for (const auto& [id, photo] : known_) input.agents.insert(photo.agent);
    return input;
  }
  const std::map<int64_t, GuidePhoto>& photos() const { return known_; }
  const std::vector<ShapePhoto>& poses() const { return photos_; }

 private:
  struct Point {
    int index;
    Eigen::Vector3d xyz;
    std::vector<uint32_t> photos;
  };

  std::vector<Point> points_;
  std::vector<ShapePhoto> photos_;
  std::map<int64_t, GuidePhoto> known_;
};

}  // namespace skein
