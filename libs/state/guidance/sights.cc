#include "guidance/sights.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "guidance/surface.h"

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
    is_placed_.resize(surfel + 1, false);
  }
  Eigen::Vector3f& drawn = positions_[surfel];
  const Eigen::Vector3f now = position.cast<float>();
  const bool was = drawn.allFinite(), is = now.allFinite();
  if (was && is && (now - drawn).norm() <= max_move_ * surfel_width_) return;
  if (was) {
    blocks_.Remove(surfel, drawn);
    gone_.push_back(drawn);
  }
  drawn = now;
  is_placed_[surfel] = true;
  if (!is) return;
  blocks_.Add(surfel, now);
  come_.push_back(now);
  come_surfels_.push_back(surfel);
}

void Sights::Update(const GuidedMap& map, const std::vector<bool>& stale_photos) {
  const auto num_photos = static_cast<uint32_t>(map.photos.size());
  const auto num_known = static_cast<uint32_t>(views_.size());
  ++num_updates_;
  has_other_grid_.assign(num_photos, false);
  has_other_photos_.assign(positions_.size(), false);
  for (uint32_t photo = num_known; photo < num_photos; ++photo) {
    views_.push_back({EmptyGrid(map, photo)});
  }
  const std::vector<bool> draws_anew = ChooseToDrawAnew(stale_photos);
  for (uint32_t photo = 0; photo < num_photos; ++photo) {
    const DepthGrid& grid = views_[photo].grid;
    if (photo >= num_known || draws_anew[photo]) {
      DrawAnew(map, photo);
      if (photo >= num_known) has_other_grid_[photo] = true;
    } else if (MeetsAny(grid, come_) || MeetsAny(grid, gone_)) {
      DrawMore(photo);
    }
  }
  is_placed_.assign(is_placed_.size(), false);
  gone_.clear();
  come_.clear();
  come_surfels_.clear();
}

std::vector<bool> Sights::ChooseToDrawAnew(const std::vector<bool>& stale_photos) {
  constexpr size_t kMaxUpdates = 16;
  std::vector<bool> chosen = stale_photos;
  std::vector<uint32_t> waiting;
  for (uint32_t photo = 0; photo < views_.size(); ++photo) {
    View& view = views_[photo];
    view.has_gone = view.has_gone || MeetsAny(view.grid, gone_);
    if (view.has_gone && !chosen[photo]) waiting.push_back(photo);
  }
  std::stable_sort(waiting.begin(), waiting.end(), [&](uint32_t a, uint32_t b) {
    return views_[a].drawn_anew < views_[b].drawn_anew;
  });
  const size_t num = max_move_ == 0 ? waiting.size() : 1 + views_.size() / kMaxUpdates;
  for (size_t i = 0; i < std::min(num, waiting.size()); ++i) chosen[waiting[i]] = true;
  return chosen;
}

DepthGrid Sights::EmptyGrid(const GuidedMap& map, uint32_t photo) const {
  return {map.cameras[map.photos[photo].camera], map.photos[photo].cam_from_world, surfel_width_,
          working_distance_};
}

void Sights::DrawAnew(const GuidedMap& map, uint32_t photo) {
  DepthGrid grid = EmptyGrid(map, photo);
  std::vector<InFrame> in_frame = grid.Draw(blocks_);
  View& view = views_[photo];
  has_other_grid_[photo] = !grid.HasDepthsOf(view.grid);
  view.grid = std::move(grid);
  view.drawn_anew = num_updates_;
  view.has_gone = false;
  Replace(photo, SeenOf(view.grid, std::move(in_frame)));
}

// What is hidden stays hidden as surfels come, so what was seen and is still there is enough to
// look at.
void Sights::DrawMore(uint32_t photo) {
  View& view = views_[photo];
  const DepthGrid before = view.grid;
  std::vector<InFrame> in_frame = view.grid.Draw(AsMatrix(come_));
  for (InFrame& surfel : in_frame) surfel.index = come_surfels_[surfel.index];
  has_other_grid_[photo] = !view.grid.HasDepthsOf(before);
  std::copy_if(view.seen.begin(), view.seen.end(), std::back_inserter(in_frame),
               [&](const InFrame& surfel) { return !is_placed_[surfel.index]; });
  Replace(photo, SeenOf(view.grid, std::move(in_frame)));
}

std::vector<InFrame> Sights::SeenOf(const DepthGrid& grid, std::vector<InFrame> in_frame) const {
  const auto hidden = [&](const InFrame& surfel) { return !grid.IsSeen(surfel, kDepthTolerance); };
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
