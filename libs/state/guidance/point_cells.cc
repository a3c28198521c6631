#include "guidance/point_cells.h"

#include <algorithm>
#include <utility>

namespace skein {

void Moments::Add(const Eigen::Vector3d& offset) {
  ++count;
  sum += offset;
  squares += offset * offset.transpose();
}

void Moments::Add(const Moments& other) {
  count += other.count;
  sum += other.sum;
  squares += other.squares;
}

uint32_t PointCells::Find(const Eigen::Vector3d& xyz) const {
  const auto cell = cells_.CellOf(xyz);
  const uint32_t* index = cell ? cells_.Find(*cell) : nullptr;
  return index == nullptr ? kNone : *index;
}

void PointCells::Mark(uint32_t cell) {
  if (!std::exchange(members_[cell].is_touched, true)) touched_.push_back(cell);
}

// Both ways, so that no update has to look for what is beside a cell.
void PointCells::Link(uint32_t cell) {
  const Cells::Cell at = members_[cell].at;
  members_[cell].beside.fill(kNone);
  for (int i = 0; i < 27; ++i) {
    const Cells::Cell other = {at[0] + i / 9 - 1, at[1] + i / 3 % 3 - 1, at[2] + i % 3 - 1};
    const uint32_t* index = cells_.Find(other);
    if (index == nullptr) continue;
    members_[cell].beside[i] = *index;
    members_[*index].beside[26 - i] = cell;
  }
  if (radius_ == 0) return;
  cells_.VisitAround(at, radius_, [&](uint32_t other) {
    members_[cell].near.push_back(other);
    if (other != cell) members_[other].near.push_back(cell);
  });
}

void PointCells::Add(uint32_t point, const Eigen::Vector3d& xyz) {
  const auto at = cells_.CellOf(xyz);
  if (!at) return;
  const uint32_t cell = cells_.Occupy(*at);
  if (cell == members_.size()) {
    members_.emplace_back();
    members_.back().at = *at;
    Link(cell);
  }
  members_[cell].points.push_back(point);
  members_[cell].has_other_points = true;
  Mark(cell);
}

void PointCells::Remove(uint32_t point, const Eigen::Vector3d& xyz) {
  const uint32_t cell = Find(xyz);
  if (cell == kNone) return;
  std::vector<uint32_t>& points = members_[cell].points;
  const auto found = std::find(points.begin(), points.end(), point);
  if (found == points.end()) return;
  points.erase(found);
  members_[cell].has_other_points = true;
  Mark(cell);
}

void PointCells::Touch(const Eigen::Vector3d& xyz) {
  const uint32_t cell = Find(xyz);
  if (cell != kNone) Mark(cell);
}

std::vector<uint32_t> PointCells::TakeTouched(const std::vector<GuidedPoint>& points) {
  std::vector<uint32_t> taken = std::exchange(touched_, {});
  const size_t num_touched = taken.size();
  for (size_t i = 0; i < num_touched; ++i) {
    Members& members = members_[taken[i]];
    if (!std::exchange(members.has_other_points, false)) continue;
    members.moments = {};
    for (const uint32_t point : members.points) members.moments.Add(points[point].xyz - origin_);
    for (const uint32_t other : members.beside) {
      if (other == kNone || std::exchange(members_[other].is_touched, true)) continue;
      taken.push_back(other);
    }
  }
  for (const uint32_t cell : taken) members_[cell].is_touched = false;
  std::sort(taken.begin(), taken.end());
  return taken;
}

Moments PointCells::MomentsAround(uint32_t cell) const {
  Moments around;
  for (const uint32_t other : members_[cell].beside) {
    if (other != kNone) around.Add(members_[other].moments);
  }
  return around;
}

std::vector<uint32_t> Observers::Of(const std::vector<uint32_t>& points) const {
  marks_.resize(map_.photos.size(), 0);
  ++mark_;
  std::vector<uint32_t> photos;
  for (const uint32_t point : points) {
    for (const uint32_t photo : map_.points[point].photos) {
      if (std::exchange(marks_[photo], mark_) != mark_) photos.push_back(photo);
    }
  }
  std::sort(photos.begin(), photos.end());
  return photos;
}

}  // namespace skein
