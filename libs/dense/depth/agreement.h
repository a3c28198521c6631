// Whether another depth map shows the surface that a depth map shows.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "depth/depth_map.h"

namespace skein {

// Another map agrees if its depth at the point differs by at most this part, and its point lies at
// most this far from the pixel.
constexpr float kMaxDepthDifference = 0.01f;
constexpr float kMaxReprojectionPx = 1;
// Another map sees past a point if it shows something behind it, by more than kMaxDepthDifference
// and by more than so many standard errors of the two depths.
constexpr float kSeesPastErrors = 3;

// A pixel and a depth of one map as another map's camera sees them. In pixels whose first centre is
// at (0, 0): (z u, z v, z) of the other camera.
class Transfer {
 public:
  Transfer(const DepthMap& from, const DepthMap& to);

  Eigen::Vector3f Apply(float x, float y, float depth) const {
    return depth * (of_pixel_ * Eigen::Vector3f(x, y, 1)) + shift_;
  }

 private:
  Eigen::Matrix3f of_pixel_;  // times depth
  Eigen::Vector3f shift_;
};

struct DepthEstimate {
  double depth = 0, error = 0;
};

// Between two maps, which must outlive it.
class Agreement {
 public:
  Agreement(const DepthMap& map, const DepthMap& other);

  // The other map's estimate of a pixel's depth, if it agrees. `behind`: the part of the depth by
  // which a map that does not agree shows something behind it, else 0.
  std::optional<DepthEstimate> Find(int x, int y, float depth, float* behind = nullptr) const;

  // Whether the other map sees past a pixel's depth: at the pixel that would show the point, and at
  // those within kMaxReprojectionPx of it that are no holes. So an edge contradicts nothing.
  bool SeesPast(int x, int y, float depth, float error) const;

 private:
  // A point as the other camera sees it: pixel indices, the nearest ones, depth.
  struct Projection {
    float u = 0, v = 0;
    int column = 0, row = 0;
    float depth = 0;
  };
  // Whether the other map's depth at a pixel is behind `depth`, as SeesPast has it. False at a
  // hole.
  bool IsBehind(int row, int column, float depth, float error) const;
  // nullopt: it lies outside the other map.
  std::optional<Projection> Project(int x, int y, float depth) const;
  std::optional<DepthEstimate> FindAt(int x, int y, const Projection& there) const;

  const DepthMap& other_;
  const Transfer there_, back_;
};

// With each of `others`, in their order.
std::vector<Agreement> AgreementsOf(const DepthMap& map,
                                    const std::vector<const DepthMap*>& others);

}  // namespace skein
