// Walls of which everything is known, and photos of them, for tests. World: metres, z up.
#pragma once

#include <random>
#include <vector>

#include "core/angles.h"
#include "guidance/quality.h"
#include "guidance/stations.h"
#include "testing/test_poses.h"

namespace skein {

inline constexpr double kDegree = DegToRad(1);

// A rectangle of points; `normal`: right x down, towards who looks at it.
struct Wall {
  Eigen::Vector3d corner, right, down;  // upper left, edges
  double density = 1;                   // of its points, as a part of the site's
  Eigen::Vector3d Normal() const { return down.cross(right).normalized(); }
};
// Faces -y.
inline Wall FrontWall(double left, double width, double height = 4, double y = 0) {
  return {{left, y, height}, {width, 0, 0}, {0, 0, -height}};
}

// Photos see each point of a wall that they look at from the front and have in their frame. Nothing
// hides anything here.
class Site {
 public:
  explicit Site(std::vector<Wall> walls, double points_per_m2 = 60) : random_(7) {
    map_.cameras = {{1200, 900, 1000, 1000, 600, 450}};
    std::uniform_real_distribution<double> unit(0, 1);
    for (const Wall& wall : walls) {
      const int count =
          static_cast<int>(wall.density * points_per_m2 * wall.right.norm() * wall.down.norm());
      for (int i = 0; i < count; ++i) {
        all_.push_back({wall.corner + unit(random_) * wall.right + unit(random_) * wall.down, {}});
        normals_.push_back(wall.Normal());
      }
    }
  }

  void Photograph(const Eigen::Vector3d& centre, const Eigen::Vector3d& target, int agent = 0) {
    Photograph(LookingAt(centre, target), agent);
  }
  void Photograph(const CameraPose& pose, int agent = 0) {
    const auto photo = static_cast<uint32_t>(map_.photos.size());
    map_.photos.push_back({photo + 1, 0, agent, pose});
    for (size_t i = 0; i < all_.size(); ++i) {
      const Eigen::Vector3d ray = pose.Centre() - all_[i].xyz;
      Eigen::Vector2d pixel;
      if (ray.dot(normals_[i]) < 0.25 * ray.norm()) continue;
      if (map_.cameras[0].Project(pose.Apply(all_[i].xyz), &pixel)) all_[i].photos.push_back(photo);
    }
  }

  // Points that at least two photos observe, as a map has them.
  GuidedMap Map() const {
    GuidedMap map = map_;
    for (const GuidedPoint& point : all_) {
      if (point.photos.size() >= 2) map.points.push_back(point);
    }
    return map;
  }

 private:
  std::mt19937 random_;
  GuidedMap map_;
  std::vector<GuidedPoint> all_;
  std::vector<Eigen::Vector3d> normals_;
};

// Five photos 1 m apart, 8 m from a wall.
inline Site SiteOfARow(const Wall& wall, double from_x, double to_x) {
  Site site({wall});
  for (double x = from_x; x <= to_x + 1e-9; x += 1) site.Photograph({x, -8, 2}, {x, 0, 2});
  return site;
}

inline PlaceQuality Assess(const GuidedMap& map) { return AssessPlace(map); }

inline StationSeeker SeekerAt(const GuidedMap& map, int agent = 0) {
  StationSeeker seeker;
  seeker.agent = agent;
  for (uint32_t i = 0; i < map.photos.size(); ++i) {
    if (map.photos[i].agent == agent) seeker.last_photo = i;
  }
  return seeker;
}

}  // namespace skein
