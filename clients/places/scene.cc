#include "clients/places/scene.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

namespace skein::sim {
namespace {

constexpr int kLeafSize = 2;

float Area(const Eigen::Array3f& low, const Eigen::Array3f& high) {
  const Eigen::Array3f size = (high - low).max(0.0f);
  return size.x() * size.y() + size.y() * size.z() + size.z() * size.x();
}

}  // namespace

PreparedSurface::PreparedSurface(const Surface& s)
    : origin(s.origin),
      normal(s.down.cross(s.right).normalized()),
      u_axis(s.right.normalized()),
      v_axis(s.down.normalized()),
      width_m(s.right.norm()),
      height_m(s.down.norm()),
      surface(s) {}

bool PreparedSurface::Contains(float u_m, float v_m) const {
  if (u_m < 0 || v_m < 0 || u_m > width_m || v_m > height_m) return false;
  if (surface.shape == Surface::Shape::kRectangle) return true;
  return std::abs(u_m / width_m - 0.5f) * 2 <= v_m / height_m;
}

Scene::Scene(const std::vector<Surface>& surfaces) {
  std::vector<Item> items;
  for (int i = 0; i < static_cast<int>(surfaces.size()); ++i) {
    const Surface& s = surfaces[i];
    Item item{s.origin, s.origin, i};
    for (const Eigen::Vector3f& corner :
         {Eigen::Vector3f(s.origin + s.right), Eigen::Vector3f(s.origin + s.down),
          Eigen::Vector3f(s.origin + s.right + s.down)}) {
      item.low = item.low.min(corner.array());
      item.high = item.high.max(corner.array());
    }
    item.low -= 1e-4f;
    item.high += 1e-4f;
    items.push_back(item);
  }
  std::vector<int> order;
  if (!items.empty()) Build(&items, 0, static_cast<int>(items.size()), &order);
  for (const int i : order) surfaces_.emplace_back(surfaces[i]);
  FindPatches();
}

void Scene::FindPatches() {
  std::map<std::array<int64_t, 9>, int> patches;
  for (int i = 0; i < size(); ++i) {
    PreparedSurface& s = surfaces_[i];
    const auto rounded = [](float value) { return std::llround(value * 500.0); };
    const std::array<int64_t, 9> key = {s.surface.texture,
                                        rounded(s.normal.x()),
                                        rounded(s.normal.y()),
                                        rounded(s.normal.z()),
                                        rounded(s.normal.dot(s.origin)),
                                        rounded(s.surface.uv.x() - s.u_axis.dot(s.origin)),
                                        rounded(s.surface.uv.y() - s.v_axis.dot(s.origin)),
                                        rounded(s.surface.tint.x()),
                                        rounded(s.surface.tint.y())};
    s.patch = patches.emplace(key, i).first->second;
  }
}

// Surface area heuristic, all splits of the three sorted axes.
void Scene::Build(std::vector<Item>* items, int begin, int end, std::vector<int>* order) {
  Node node;
  Eigen::Array3f node_low = (*items)[begin].low, node_high = (*items)[begin].high;
  for (int i = begin; i < end; ++i) {
    node_low = node_low.min((*items)[i].low);
    node_high = node_high.max((*items)[i].high);
  }
  node.low << node_low.x(), node_low.y(), node_low.z(), 0;
  node.high << node_high.x(), node_high.y(), node_high.z(), 0;
  const int index = static_cast<int>(nodes_.size());
  if (end - begin <= kLeafSize) {
    node.first = static_cast<int>(order->size());
    node.count = end - begin;
    nodes_.push_back(node);
    for (int i = begin; i < end; ++i) order->push_back((*items)[i].surface);
    return;
  }
  const auto sort = [&](int axis) {
    std::sort(items->begin() + begin, items->begin() + end, [axis](const Item& a, const Item& b) {
      const float ca = a.low[axis] + a.high[axis], cb = b.low[axis] + b.high[axis];
      return ca != cb ? ca < cb : a.surface < b.surface;
    });
  };
  int best_axis = 0, best_split = (begin + end) / 2;
  float best_cost = std::numeric_limits<float>::max();
  std::vector<float> left_area(end - begin);
  for (int axis = 0; axis < 3; ++axis) {
    sort(axis);
    Eigen::Array3f low = (*items)[begin].low, high = (*items)[begin].high;
    for (int i = begin; i < end; ++i) {
      low = low.min((*items)[i].low);
      high = high.max((*items)[i].high);
      left_area[i - begin] = Area(low, high);
    }
    low = (*items)[end - 1].low;
    high = (*items)[end - 1].high;
    for (int i = end - 1; i > begin; --i) {
      low = low.min((*items)[i].low);
      high = high.max((*items)[i].high);
      const float cost = left_area[i - 1 - begin] * (i - begin) + Area(low, high) * (end - i);
      if (cost < best_cost) {
        best_cost = cost;
        best_axis = axis;
        best_split = i;
      }
    }
  }
  sort(best_axis);
  node.count = 0;
  nodes_.push_back(node);
  Build(items, begin, best_split, order);
  nodes_[index].first = static_cast<int>(nodes_.size());
  Build(items, best_split, end, order);
}

template <bool kAny>
Hit Scene::Walk(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction, float min_t,
                float max_t) const {
  Hit hit;
  hit.t = max_t;
  if (nodes_.empty()) return hit;
  // The fourth axis never limits: its slab is entered at 0 and left at infinity.
  Eigen::Array4f from, inverse;
  from << origin.x(), origin.y(), origin.z(), 0;
  inverse << 1 / direction.x(), 1 / direction.y(), 1 / direction.z(), 0;
  const Eigen::Array4f open(0, 0, 0, std::numeric_limits<float>::max());
  // Distance to a node's box. Infinity when the ray misses it or enters behind the nearest hit.
  const auto entry = [&](const Node& node) {
    const Eigen::Array4f t0 = (node.low - from) * inverse;
    const Eigen::Array4f t1 = (node.high - from) * inverse;
    const float near = std::max(t0.min(t1).maxCoeff(), min_t);
    const float far = std::min((t0.max(t1) + open).minCoeff(), hit.t);
    return near <= far ? near : std::numeric_limits<float>::infinity();
  };
  struct Pending {
    int node;
    float t;
  };
  Pending stack[64];
  int depth = 0;
  stack[depth++] = {0, entry(nodes_[0])};
  while (depth > 0) {
    const Pending pending = stack[--depth];
    if (!(pending.t < hit.t)) continue;
    const Node& node = nodes_[pending.node];
    if (node.count == 0) {
      const int left = pending.node + 1, right = node.first;
      const float t_left = entry(nodes_[left]), t_right = entry(nodes_[right]);
      const bool left_first = t_left <= t_right;
      const Pending near{left_first ? left : right, std::min(t_left, t_right)};
      const Pending far{left_first ? right : left, std::max(t_left, t_right)};
      if (std::isfinite(far.t)) stack[depth++] = far;
      if (std::isfinite(near.t)) stack[depth++] = near;
      continue;
    }
    for (int i = node.first; i < node.first + node.count; ++i) {
      const PreparedSurface& s = surfaces_[i];
      const float slope = s.normal.dot(direction);
      if (std::abs(slope) < 1e-9f) continue;
      const float t = s.normal.dot(s.origin - origin) / slope;
      if (!(t > min_t && t < hit.t)) continue;
      const Eigen::Vector3f offset = origin + t * direction - s.origin;
      if (!s.Contains(offset.dot(s.u_axis), offset.dot(s.v_axis))) continue;
      hit.surface = i;
      hit.t = t;
      if (kAny) return hit;
    }
  }
  return hit;
}

Hit Scene::Trace(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction,
                 float min_t) const {
  return Walk<false>(origin, direction, min_t, std::numeric_limits<float>::max());
}

bool Scene::Occluded(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction,
                     float max_t) const {
  return Walk<true>(origin, direction, 1e-3f, max_t).surface >= 0;
}

}  // namespace skein::sim
