// The geometry of a synthetic place: flat surfaces in a bounding volume hierarchy.
// World frame: metres, z up.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

namespace skein::sim {

// A rectangle, or the isosceles triangle that stands on its lower edge (a gable).
struct Surface {
  enum class Shape : uint8_t { kRectangle, kGable };

  Eigen::Vector3f origin;  // upper left corner, seen from outside
  Eigen::Vector3f right;   // edges, metres, at right angles
  Eigen::Vector3f down;
  Shape shape = Shape::kRectangle;
  int texture = 0;
  Eigen::Vector2f uv = Eigen::Vector2f::Zero();  // texture position of `origin`, metres
  float detail = 0.3f;                           // strength of the fine grain seen from close by
  Eigen::Vector3f tint = Eigen::Vector3f::Ones();
};

// A surface with what intersection needs.
struct PreparedSurface {
  Eigen::Vector3f origin, normal, u_axis, v_axis;  // unit vectors; the normal points outside
  float width_m, height_m;
  Surface surface;
  int patch = 0;  // the first of the surfaces that lie in one plane and show one picture

  explicit PreparedSurface(const Surface& s);
  bool Contains(float u_m, float v_m) const;
};

struct Hit {
  int surface = -1;  // -1: the sky
  float t = 0;       // along the ray, in lengths of its direction
};

class Scene {
 public:
  Scene() = default;
  explicit Scene(const std::vector<Surface>& surfaces);

  // Nearest surface on origin + t * direction, t > `min_t`.
  Hit Trace(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction,
            float min_t = 1e-4f) const;
  bool Occluded(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction, float max_t) const;

  const PreparedSurface& surface(int i) const { return surfaces_[i]; }
  int size() const { return static_cast<int>(surfaces_.size()); }

 private:
  struct Node {
    Eigen::Array4f low, high;  // the fourth is 0: four floats are one SIMD register
    int32_t first = 0;         // leaf: first surface; inner: right child (the left one is next)
    int32_t count = 0;         // 0: inner
  };
  struct Item {
    Eigen::Array3f low, high;
    int surface;
  };
  void FindPatches();
  void Build(std::vector<Item>* items, int begin, int end, std::vector<int>* order);
  template <bool kAny>
  Hit Walk(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction, float min_t,
           float max_t) const;

  std::vector<PreparedSurface> surfaces_;
  std::vector<Node> nodes_;
};

}  // namespace skein::sim
