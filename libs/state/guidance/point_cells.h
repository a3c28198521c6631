// The points of a map by the cells that they lie in, as they come and go. Inside of
// libs/state/guidance.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "guidance/cells.h"
#include "guidance/guided_map.h"

namespace skein {

// Sums of points, less a common origin near them: of cells together they are added.
struct Moments {
  size_t count = 0;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();

  void Add(const Eigen::Vector3d& offset);
  void Add(const Moments& other);
};

// Cells keep their index, also without points.
class PointCells {
 public:
  static constexpr uint32_t kNone = UINT32_MAX;

  PointCells() : PointCells(1, Eigen::Vector3d::Zero()) {}
  // radius: in cells, of VisitNear; 0: it is not used.
  PointCells(double width, const Eigen::Vector3d& origin, int radius = 0)
      : cells_(width), origin_(origin), radius_(radius) {}

  // Points by their index in the map. A point too far away has no cell.
  void Add(uint32_t point, const Eigen::Vector3d& xyz);
  void Remove(uint32_t point, const Eigen::Vector3d& xyz);
  // A point at `xyz` has other observers, or its cell is to be looked at again.
  void Touch(const Eigen::Vector3d& xyz);
  // Cells with other points or observers, or beside one with other points, since the last call.
  // Ascending. Their moments are up to date then.
  std::vector<uint32_t> TakeTouched(const std::vector<GuidedPoint>& points);

  size_t size() const { return members_.size(); }
  double width() const { return cells_.width(); }
  const std::vector<uint32_t>& PointsOf(uint32_t cell) const { return members_[cell].points; }
  Moments MomentsAround(uint32_t cell) const;
  // kNone where no point was.
  uint32_t Find(const Eigen::Vector3d& xyz) const;
  // visit(other) for `cell` and the cells beside it.
  template <class Visit>
  void VisitBeside(uint32_t cell, const Visit& visit) const {
    for (const uint32_t other : members_[cell].beside) {
      if (other != kNone) visit(other);
    }
  }
  // As Cells::VisitAround, up to the radius.
  template <class Visit>
  void VisitNear(uint32_t cell, const Visit& visit) const {
    for (const uint32_t other : members_[cell].near) visit(other);
  }

 private:
  struct Members {
    Cells::Cell at;
    std::vector<uint32_t> points;
    Moments moments;
    std::array<uint32_t, 27> beside;  // the cell itself, too
    std::vector<uint32_t> near;       // the same, within the radius
    bool is_touched = false, has_other_points = false;
  };

  void Link(uint32_t cell);
  void Mark(uint32_t cell);

  Cells cells_;
  Eigen::Vector3d origin_;
  int radius_;
  std::vector<Members> members_;  // by cell
  std::vector<uint32_t> touched_;
};

// Photos that observe one of the points, ascending. Keeps a mark a photo from call to call.
class Observers {
 public:
  explicit Observers(const GuidedMap& map) : map_(map) {}

  std::vector<uint32_t> Of(const std::vector<uint32_t>& points) const;

 private:
  const GuidedMap& map_;
  mutable std::vector<uint32_t> marks_;  // by photo
  mutable uint32_t mark_ = 0;
};

}  // namespace skein
