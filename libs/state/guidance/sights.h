// Visibility of a surface's surfels in photos, as photos and surfels come, move and go. Inside of
// libs/state/guidance.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "guidance/depth_grid.h"
#include "guidance/guided_map.h"
#include "guidance/surfel_blocks.h"

namespace skein {

// About 16 bytes a photo and surfel that it sees.
class Sights {
 public:
  Sights() = default;
  // max_move: in surfel widths, as Place has it.
  Sights(double surfel_width, double working_distance, double max_move)
      : blocks_(surfel_width),
        surfel_width_(surfel_width),
        working_distance_(working_distance),
        max_move_(max_move) {}

  // Position of a surfel from the next Update on; not finite: the surfel has none. A surfel stays
  // drawn where it was until it moves by more than max_move: surfaces up to a surfel's width behind
  // are not hidden anyway.
  void Place(uint32_t surfel, const Eigen::Vector3d& position);
  // Draws what changed: all of photos that are new or stale (by their index), of others the surfels
  // that came. Photos that have drawn a surfel which has gone are drawn again by a sixteenth of all
  // photos an update, longest ago first, so it hides for sixteen updates at most; all at once where
  // max_move is 0.
  void Update(const GuidedMap& map, const std::vector<bool>& stale_photos);

  const DepthGrid& GridOf(uint32_t photo) const { return views_[photo].grid; }
  // Ascending; with nothing in front, from any side.
  const std::vector<uint32_t>& PhotosOf(uint32_t surfel) const { return photos_[surfel]; }
  // By the last update.
  bool HasOtherGrid(uint32_t photo) const { return has_other_grid_[photo]; }
  bool HasOtherPhotos(uint32_t surfel) const { return has_other_photos_[surfel]; }

 private:
  struct View {
    DepthGrid grid;
    std::vector<DepthGrid::InFrame> seen = {};  // by surfel, ascending
    uint64_t drawn_anew = 0;                    // in this update
    bool has_gone = false;                      // a surfel that was drawn
  };

  DepthGrid EmptyGrid(const GuidedMap& map, uint32_t photo) const;
  std::vector<bool> ChooseToDrawAnew(const std::vector<bool>& stale_photos);
  void DrawAnew(const GuidedMap& map, uint32_t photo);
  void DrawMore(uint32_t photo);
  std::vector<DepthGrid::InFrame> SeenOf(const DepthGrid& grid,
                                         std::vector<DepthGrid::InFrame> in_frame) const;
  void Replace(uint32_t photo, std::vector<DepthGrid::InFrame> seen);

  std::vector<Eigen::Vector3f> positions_;  // of the surfels; NaN: none
  SurfelBlocks blocks_;                     // the same
  double surfel_width_ = 0, working_distance_ = 0, max_move_ = 0;
  std::vector<View> views_;                    // of the photos
  std::vector<std::vector<uint32_t>> photos_;  // of the surfels
  std::vector<bool> has_other_grid_, has_other_photos_;
  // Since the last update: by surfel, whether it came or went; positions.
  std::vector<bool> is_placed_;
  std::vector<Eigen::Vector3f> gone_, come_;
  std::vector<uint32_t> come_surfels_;
  uint64_t num_updates_ = 0;
};

}  // namespace skein
