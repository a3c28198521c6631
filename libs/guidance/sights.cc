#include "guidance/sights.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace skein {
namespace {

using InFrame = DepthGrid::InFrame;

bool BySurfel(const InFrame& a, const InFrame& b) { return a.index < b.index; }

DepthGrid::Positions AsMatrix(const std::vector<Eigen::Vector3f>& positions) {
  return {positions.empty() ? nullptr : positions.front().data(), 3,
          static_cast<Eigen::Index>(positions.size())};
}

bool MeetsAny(const DepthGrid& grid, const std::vector<Eigen::Vector3f>& positions) {
  return std::any_of(positions.begin(), positions.end(),
                     [&](const Eigen::Vector3f& position) { return grid.Meets(position); });
}

}  // namespace

void Sights::Place(uint32_t surfel, const Eigen::Vector3d& position) {
  constexpr float kNowhere = std::numeric_limits<float>::quiet_NaN();
  if (surfel >= positions_.size()) {
    positions_.resize(surfel + 1, Eigen::Vector3f::Constant(kNowhere));
    photos_.resize(surfel + 1);
    has_come_.resize(surfel + 1, false);
  }
  Eigen::Vector3f& known = positions_[surfel];
  const Eigen::Vector3f before = std::exchange(known, position.cast<float>());
  const bool was = before.allFinite(), is = known.allFinite();
  const bool leaves_trace = was && is && (known - before).norm() <= max_trace_ * surfel_width_;
  if (was) blocks_.Remove(surfel, before);
  if (was && !leaves_trace) gone_.push_back(before);
  if (!is) return;
  blocks_.Add(surfel, known);
  come_.push_back(known);
  come_surfels_.push_back(surfel);
  has_come_[surfel] = true;
}

void Sights::Update(const GuidedMap& map, const std::vector<bool>& stale_photos) {
  const auto num_photos = static_cast<uint32_t>(map.photos.size());
  has_other_grid_.assign(num_photos, false);
  has_other_photos_.assign(positions_.size(), false);
  for (uint32_t photo = 0; photo < num_photos; ++photo) {
    const bool is_new = photo >= views_.size();
    if (is_new) views_.push_back({EmptyGrid(map, photo), {}});
    if (is_new || stale_photos[photo] || MeetsAny(views_[photo].grid, gone_)) {
      DrawAnew(map, photo);
      if (is_new) has_other_grid_[photo] = true;
    } else if (MeetsAny(views_[photo].grid, come_)) {
      DrawMore(photo);
    }
  }
  for (const uint32_t surfel : come_surfels_) has_come_[surfel] = false;
  gone_.clear();
  come_.clear();
  come_surfels_.clear();
}

DepthGrid Sights::EmptyGrid(const GuidedMap& map, uint32_t photo) const {
  return {map.cameras[map.photos[photo].camera], map.photos[photo].cam_from_world, surfel_width_,
          working_distance_};
}

void Sights::DrawAnew(const GuidedMap& map, uint32_t photo) {
  DepthGrid grid = EmptyGrid(map, photo);
  std::vector<InFrame> in_frame = grid.Draw(blocks_);
  has_other_grid_[photo] = !grid.HasDepthsOf(views_[photo].grid);
  views_[photo].grid = std::move(grid);
  Replace(photo, SeenOf(views_[photo].grid, std::move(in_frame)));
}

// What is hidden stays hidden as surfels come, so what was seen is enough to look at.
void Sights::DrawMore(uint32_t photo) {
  View& view = views_[photo];
  const DepthGrid before = view.grid;
  std::vector<InFrame> in_frame = view.grid.Draw(AsMatrix(come_));
  for (InFrame& surfel : in_frame) surfel.index = come_surfels_[surfel.index];
  has_other_grid_[photo] = !view.grid.HasDepthsOf(before);
  std::copy_if(view.seen.begin(), view.seen.end(), std::back_inserter(in_frame),
               [&](const InFrame& surfel) { return !has_come_[surfel.index]; });
  Replace(photo, SeenOf(view.grid, std::move(in_frame)));
}

std::vector<InFrame> Sights::SeenOf(const DepthGrid& grid, std::vector<InFrame> in_frame) const {
  const auto hidden = [&](const InFrame& surfel) { return !grid.IsSeen(surfel, depth_tolerance_); };
  in_frame.erase(std::remove_if(in_frame.begin(), in_frame.end(), hidden), in_frame.end());
  return in_frame;
}

void Sights::Replace(uint32_t photo, std::vector<InFrame> seen) {
  std::sort(seen.begin(), seen.end(), BySurfel);
  std::vector<InFrame>& before = views_[photo].seen;
  std::vector<InFrame> lost, found;
  std::set_difference(before.begin(), before.end(), seen.begin(), seen.end(),
                      std::back_inserter(lost), BySurfel);
  std::set_difference(seen.begin(), seen.end(), before.begin(), before.end(),
                      std::back_inserter(found), BySurfel);
  for (const InFrame& surfel : lost) {
    std::vector<uint32_t>& photos = photos_[surfel.index];
    photos.erase(std::lower_bound(photos.begin(), photos.end(), photo));
    has_other_photos_[surfel.index] = true;
  }
  for (const InFrame& surfel : found) {
    std::vector<uint32_t>& photos = photos_[surfel.index];
    photos.insert(std::lower_bound(photos.begin(), photos.end(), photo), photo);
    has_other_photos_[surfel.index] = true;
  }
  before = std::move(seen);
}

}  // namespace skein
