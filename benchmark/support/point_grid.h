// Points in cubes, for neighbours within a radius.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <unordered_map>
#include <vector>

namespace skein {

class PointGrid {
 public:
  // `width`: of a cube; the radius of the queries, about.
  explicit PointGrid(double width) : width_(width) {}

  void Add(const Eigen::Vector3d& point, uint32_t index) {
    cubes_[KeyOf(CubeOf(point))].push_back({point, index});
  }

  // Calls fn(index, point) for each within `radius`, until it returns false.
  template <class Fn>
  void ForNear(const Eigen::Vector3d& center, double radius, const Fn& fn) const {
    const Cube low = CubeOf(center.array() - radius), high = CubeOf(center.array() + radius);
    for (int64_t x = low.x(); x <= high.x(); ++x) {
      for (int64_t y = low.y(); y <= high.y(); ++y) {
        for (int64_t z = low.z(); z <= high.z(); ++z) {
          const auto cube = cubes_.find(KeyOf({x, y, z}));
          if (cube == cubes_.end()) continue;
          for (const Entry& entry : cube->second) {
            if ((entry.point - center).squaredNorm() > radius * radius) continue;
            if (!fn(entry.index, entry.point)) return;
          }
        }
      }
    }
  }

  bool AnyNear(const Eigen::Vector3d& center, double radius) const {
    bool any = false;
    ForNear(center, radius, [&](uint32_t, const Eigen::Vector3d&) {
      any = true;
      return false;
    });
    return any;
  }

 private:
  using Cube = Eigen::Matrix<int64_t, 3, 1>;
  struct Entry {
    Eigen::Vector3d point;
    uint32_t index;
  };

  Cube CubeOf(const Eigen::Vector3d& point) const {
    return (point / width_).array().floor().cast<int64_t>();
  }
  // 21 bits an axis: places of two million cubes a side.
  static uint64_t KeyOf(const Cube& cube) {
    const auto bits = [](int64_t value) { return static_cast<uint64_t>(value) & 0x1fffff; };
    return bits(cube.x()) << 42 | bits(cube.y()) << 21 | bits(cube.z());
  }

  double width_;
  std::unordered_map<uint64_t, std::vector<Entry>> cubes_;
};

}  // namespace skein
