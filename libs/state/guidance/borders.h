// Finds the ends of a surface, and tells whether photos show what lies beyond. Inside of
// libs/state/guidance.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <vector>

#include "guidance/guided_map.h"
#include "guidance/sights.h"
#include "guidance/surface.h"

namespace skein {

// An end of the surface at a surfel: by the surfels around it.
struct End {
  bool is_ground = false;  // ground has no end
  bool is_end = false;
  bool may_turn = false;                                // away, as at the corner of a house
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  // away from the surface, unit
};

bool LooksAhead(const GuidedMap& map, const Eigen::Vector3d& up);
// Photos that look ahead are of what stands upright; the ground goes on without end.
bool IsGround(const Surfel& surfel, const Eigen::Vector3d& up, bool looks_ahead);

// `around`: at most two cells away along each axis, itself too.
End FindEnd(const Surfel& surfel, const std::vector<const Surfel*>& around,
            const Eigen::Vector3d& up, bool looks_ahead);

// Finds frontiers: ends of a surface beyond which less than two photos look.
class Borders {
 public:
  Borders(const std::vector<Eigen::Vector3d>& centres, const Sights& sights, double cell)
      : centres_(centres), sights_(sights), cell_(cell) {}

  // Sets what a surfel says of its end and of beyond. Costs the number of photos where it is open.
  void Judge(const End& end, Surfel* surfel) const;
  // Whether Judge may come out otherwise with another view of the photo.
  bool MayDependOn(uint32_t photo, const End& end, const Surfel& surfel) const;
  // The same where only what else the photo sees differs.
  bool MayDependOnGridOf(uint32_t photo, const End& end, const Surfel& surfel) const;

 private:
  Eigen::Vector3d BeyondOf(const End& end, const Surfel& surfel) const;
  Eigen::Vector3d BehindOf(const Surfel& surfel) const;
  bool IsLookedAt(const Eigen::Vector3d& place, const Eigen::Vector3d& normal,
                  bool may_be_hidden) const;

  const std::vector<Eigen::Vector3d>& centres_;  // of the photos
  const Sights& sights_;
  const double min_cos_ = std::cos(kMaxSurfelIncidenceDeg * kRadian);
  const double cell_;
};

}  // namespace skein
