#include "guidance/borders.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace skein {
namespace {

constexpr int kEnoughPhotos = 2;

// Directions in the surfel's plane, as angles, of those around it.
std::vector<double> AnglesAround(const Surfel& surfel, const std::vector<const Surfel*>& around,
                                 const Eigen::Vector3d& x_axis, const Eigen::Vector3d& y_axis) {
  std::vector<double> angles;
  for (const Surfel* other : around) {
    const Eigen::Vector3d offset = other->position - surfel.position;
    const double x = offset.dot(x_axis), y = offset.dot(y_axis);
    if (std::hypot(x, y) > 1e-9 * offset.norm()) angles.push_back(std::atan2(y, x));
  }
  std::sort(angles.begin(), angles.end());
  return angles;
}

// Where nothing is around a surfel: the middle of the widest gap between its neighbours, if that is
// wide enough for an end of the surface.
bool FindGap(const Surfel& surfel, const std::vector<const Surfel*>& around,
             Eigen::Vector3d* direction) {
  constexpr double kMinGap = 135 * kRadian;
  const Eigen::Vector3d x_axis = surfel.normal.unitOrthogonal();
  const Eigen::Vector3d y_axis = surfel.normal.cross(x_axis);
  const std::vector<double> angles = AnglesAround(surfel, around, x_axis, y_axis);
  if (angles.size() < 2) return false;
  double widest = 0, middle = 0;
  for (size_t i = 0; i < angles.size(); ++i) {
    const double next = i + 1 < angles.size() ? angles[i + 1] : angles[0] + 360 * kRadian;
    if (next - angles[i] > widest) {
      widest = next - angles[i];
      middle = 0.5 * (next + angles[i]);
    }
  }
  *direction = std::cos(middle) * x_axis + std::sin(middle) * y_axis;
  return widest >= kMinGap;
}

}  // namespace

bool LooksAhead(const GuidedMap& map, const Eigen::Vector3d& up) {
  double down = 0;
  for (const GuidedPhoto& photo : map.photos) {
    down -= AheadOf(photo.cam_from_world).dot(up);
  }
  return down < 0.5 * static_cast<double>(map.photos.size());
}

bool IsGround(const Surfel& surfel, const Eigen::Vector3d& up, bool looks_ahead) {
  constexpr double kMinLevel = 0.7;
  return looks_ahead && surfel.normal.dot(up) > kMinLevel;
}

// What turns away above a wall or below an edge is out of many photographers' reach, and would keep
// every place open.
End FindEnd(const Surfel& surfel, const std::vector<const Surfel*>& around,
            const Eigen::Vector3d& up, bool looks_ahead) {
  constexpr double kMaxUpright = 0.5;
  End end;
  end.is_ground = IsGround(surfel, up, looks_ahead);
  if (end.is_ground) return end;
  end.is_end = FindGap(surfel, around, &end.direction);
  end.may_turn = end.is_end && std::abs(end.direction.dot(up)) < kMaxUpright &&
                 std::abs(surfel.normal.dot(up)) < kMaxUpright;
  return end;
}

Eigen::Vector3d Borders::BeyondOf(const End& end, const Surfel& surfel) const {
  constexpr int kCellsBeyond = 2;
  return surfel.position + kCellsBeyond * cell_ * end.direction;
}

Eigen::Vector3d Borders::BehindOf(const Surfel& surfel) const {
  constexpr double kCellsBehind = 2;
  return surfel.position - kCellsBehind * cell_ * surfel.normal;
}

// Whether enough photos would show a face there that looks along `normal`.
bool Borders::IsLookedAt(const Eigen::Vector3d& place, const Eigen::Vector3d& normal,
                         bool may_be_hidden) const {
  int count = 0;
  for (uint32_t photo = 0; photo < centres_.size() && count < kEnoughPhotos; ++photo) {
    const Eigen::Vector3d ray = centres_[photo] - place;
    if (ray.dot(normal) < min_cos_ * ray.norm()) continue;
    const DepthGrid::Sight sight = sights_.GridOf(photo).Look(place, 0);
    count +=
        sight == DepthGrid::Sight::kSeen || (may_be_hidden && sight == DepthGrid::Sight::kHidden);
  }
  return count >= kEnoughPhotos;
}

// Straight ahead a place may be hidden: it lies behind another surface then, as where a wall meets
// the ground. A face that turns away at a right angle may not.
void Borders::Judge(const End& end, Surfel* surfel) const {
  surfel->is_ground = end.is_ground;
  surfel->at_end = end.is_end;
  surfel->open_border = false;
  surfel->beyond = surfel->position;
  surfel->beyond_normal = surfel->normal;
  surfel->beyond_max_deg = end.is_end ? kMaxSurfelIncidenceDeg : 0;
  if (!end.is_end) return;
  const Eigen::Vector3d beyond = BeyondOf(end, *surfel);
  surfel->open_border = !IsLookedAt(beyond, surfel->normal, true);
  if (surfel->open_border) {
    surfel->beyond = beyond;
  } else if (end.may_turn && !IsLookedAt(BehindOf(*surfel), end.direction, false)) {
    surfel->open_border = true;
    surfel->beyond = BehindOf(*surfel);
    surfel->beyond_normal = (surfel->normal + end.direction).normalized();
    surfel->beyond_max_deg =
        kMaxSurfelIncidenceDeg - 45;  // none of these is further off the face's
  }
}

bool Borders::MayDependOn(uint32_t photo, const End& end, const Surfel& surfel) const {
  return sights_.GridOf(photo).Look(BeyondOf(end, surfel), 0) != DepthGrid::Sight::kOutside ||
         MayDependOnGridOf(photo, end, surfel);
}

bool Borders::MayDependOnGridOf(uint32_t photo, const End& end, const Surfel& surfel) const {
  return end.may_turn &&
         sights_.GridOf(photo).Look(BehindOf(surfel), 0) != DepthGrid::Sight::kOutside;
}

}  // namespace skein
