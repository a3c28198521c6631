// How complete a place is, while its map grows.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "guidance/guided_map.h"
#include "guidance/holes.h"
#include "guidance/live_surface.h"
#include "guidance/quality.h"
#include "guidance/textured_share.h"

namespace skein {

// An update recomputes only what has changed: cells with other points, the depth grids of photos
// that have such a cell in their frame, and the quality of what other photos see. Beside that it
// looks once at each observation of the map.
//
// Values are updated only if they moved by more than a share of t = Holding::tolerance. Results
// therefore differ from AssessPlace(map) by at most that. The shares:
//   surfels, parts   position t * (width of their cell); normal t rad
//   poses, cameras   t * (a square of the depth grid), in the photo
//   points           2.5 * t * (a part's cell)
//   depth grids      a surfel is drawn within 5 * t * cell of its position, and hides others for up
//                    to 16 updates after it went (Sights)
//   vertical         t / 10 rad
// If a length of PlaceScale is off by more than t of it, all is recomputed. With t = 0 every value
// is updated.
//
// Memory: about 40 KB a photo of 640 x 480, and 1 KB a surfel with its parts and points.
class LivePlace {
 public:
  explicit LivePlace(const Holding& holding = {});
  LivePlace(const LivePlace&) = delete;
  LivePlace& operator=(const LivePlace&) = delete;

  // The map as it is now. Photos, cameras and points keep their index from update to update, new
  // ones follow; a point without photos is none. If the photos are no longer the same, all is made
  // again, as in a first update. target_gsd: as AssessPlace has it; held until it is off by a fifth
  // of the tolerance.
  const PlaceQuality& Update(const GuidedMap& map, double target_gsd);

  const PlaceQuality& place() const { return place_; }
  // The map as it is held.
  const GuidedMap& map() const { return surface_.map(); }
  // Leaves nothing here.
  PlaceQuality Take() { return std::move(place_); }

 private:
  using Change = LiveSurface::Change;

  void Clear();
  bool SetTarget(double target_gsd);
  void AssessSurfels();
  void AssessParts();
  void AssessAgain();
  void Assess(const Surfel& surfel, double width, const Change& change, TexturedShare* texture,
              SurfelQuality* quality) const;
  void AssessGeometry(const Surfel& surfel, const TexturedShare& texture,
                      SurfelQuality* quality) const;
  void JudgeWholes();
  uint32_t AddPiece();
  void RemovePiece(uint32_t* piece);

  double target_gsd_ = 0, max_gsd_ = 0;
  const double tolerance_;
  PlaceQuality place_;
  LiveSurface surface_;  // writes place_.surface
  Holes holes_;
  std::vector<TexturedShare> surfel_textures_, part_textures_;
  // Pieces of the parts, and of the surfels without parts; kNone: none.
  std::vector<uint32_t> piece_of_part_, piece_of_surfel_;
  std::vector<uint32_t> free_pieces_;
};

// Inside of libs/state/guidance: of place.surfels and place.pieces.
Completeness Summarise(double target_gsd, double max_gsd, const PlaceQuality& place,
                       double hole_share);

}  // namespace skein
