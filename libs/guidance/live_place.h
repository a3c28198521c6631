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

// Of each update only what has changed is made anew: cells with other points, the depth grids of
// photos that have such a cell in their frame, and the quality of what other photos see. Beside
// that an update looks once at each observation of the map.
//
// Some is held until it is off by more than Holding::tolerance, and so part of what AssessPlace of
// the same map gives. That is of surfels their cell and a radian in their normal, of poses and
// cameras a cell in the photo. Points are held within 2.5 times that of a part's cell. What hides a
// surfel is drawn within 5 times that of its cell, and for up to 16 updates after it went (Sights).
// Of the vertical it is a tenth in radians. When a length of PlaceScale is off by more than
// `tolerance`, all is made anew. With tolerance 0 nothing is held.
//
// Memory: about 40 KB a photo of 640 x 480, and 1 KB a surfel with its parts and points.
class LivePlace {
 public:
  LivePlace(const SurfaceOptions& surface_options, const QualityOptions& quality_options,
            const Holding& holding = {});
  LivePlace(const LivePlace&) = delete;
  LivePlace& operator=(const LivePlace&) = delete;

  // The map as it is now. Photos, cameras and points keep their index from update to update, new
  // ones follow; a point without photos is none. Where photos are no longer the same, all is made
  // anew, as a first update. target_gsd: as QualityOptions has it; held until it is off by a fifth
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

  QualityOptions options_;  // with the target, and what counts
  const double max_gsd_;    // as it was given
  const double tolerance_;
  PlaceQuality place_;
  LiveSurface surface_;  // writes place_.surface
  Holes holes_;
  std::vector<TexturedShare> surfel_textures_, part_textures_;
  // Pieces of the parts, and of the surfels without parts; kNone: none.
  std::vector<uint32_t> piece_of_part_, piece_of_surfel_;
  std::vector<uint32_t> free_pieces_;
};

// Inside of libs/guidance: of place.surfels and place.pieces.
Completeness Summarise(const QualityOptions& options, const PlaceQuality& place, double hole_share);

}  // namespace skein
