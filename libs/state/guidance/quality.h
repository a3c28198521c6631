// How well dense matching can reconstruct a piece of surface from the photos that see it.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "guidance/guided_map.h"
#include "guidance/surface.h"

namespace skein {

// A surfel is good when two photos have it at target_gsd, the ground sampling distance that is
// wanted (submap units a pixel), and all of these hold. Reconstructability 1.2: three photos
// 10 degrees apart that look straight at it from the distance of the target.
constexpr size_t kMinSurfelPhotos = 3;
constexpr double kMinReconstructability = 1.2;
constexpr double kMaxSigmaGsd = 3;  // standard deviation of its depth, in target_gsd, at 1 px
// Part of it and what is around it that has texture in at least kMinSurfelPhotos photos. 0.8: the
// completeness from which a surfel is truly good in docs/experiments/guidance.md.
constexpr double kMinTexturedShare = 0.8;
// Cosine of 45 degrees: less from the side are a pair of photos that adds to reconstructability,
// and a photo that looks straight at a surfel.
constexpr double kMinCosIncidence = 0.7071067811865476;
// A place is complete if good share >= kMinGoodShare and open share <= kMaxOpenShare: bushes and
// eaves have frontiers that no photo can close.
constexpr double kMinGoodShare = 0.9;
constexpr double kMaxOpenShare = 0.03;

// target_gsd of so many millimetres a pixel.
inline double TargetGsd(double target_gsd_mm, double metres_per_unit) {
  return target_gsd_mm / 1000 / metres_per_unit;
}

// A photo as one surfel sees it.
struct ViewOfSurfel {
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  // unit, from the surfel to the camera
  double gsd = 0;                                       // submap units a pixel
};

struct SurfelQuality {
  int num_photos = 0;
  double best_gsd = 0;  // of the second best photo, as depth takes two
  // Smith et al. 2018, "Aerial path planning for urban scene reconstruction", equation 3 (pairs of
  // photos weighted by parallax, distance, matchability and incidence), with the distance in
  // ground sampling distance.
  double reconstructability = 0;
  // Along the normal: sqrt(n' (sum J'J)^-1 n) for 1 px, over the photos that match another one,
  // submap units. Infinite where no two do.
  double sigma = 0;
  double textured_share = 1;  // textured_share.h
  bool counts = false;        // two photos have it at Completeness::max_gsd
  bool good = false;
};

// Unit of assessment: a part of a surfel (DetailedSurface), or the whole surfel if its points are
// too few for parts. A surfel may be as wide as a chair: its normal is none of the chair's sides',
// and a photo that sees its middle may see half of it.
struct Piece {
  Surfel surfel;
  double width = 0;    // of its cell
  uint32_t whole = 0;  // the surfel that it is of: index into PlaceQuality::surface
  // (area of the surfel) / (number of its pieces), submap units squared: there is surface between
  // the points, too.
  double area = 0;
  SurfelQuality quality;

  bool IsGone() const { return width == 0; }  // a gap (PlaceQuality)
};

// Whether dense matching finds anything to match there. No photo makes a bare wall good.
inline bool HasTexture(const SurfelQuality& quality) {
  return quality.textured_share >= kMinTexturedShare;
}

// By geometry alone: as if it had texture. Leaves `counts` false.
SurfelQuality AssessSurfel(double target_gsd, const Eigen::Vector3d& normal,
                           const std::vector<ViewOfSurfel>& views);

// How complete a place is. Shares are of the area that counts.
struct Completeness {
  double area = 0;          // that counts, submap units squared
  double ground_share = 0;  // that would count, were it no ground: as a part of both
  double good_share = 0;
  double open_share = 0;    // of the surfels at an end of the surface: at a frontier
  double hole_share = 0;    // of what the photos show: without points (holes.h)
  double median_sigma = 0;  // submap units at 1 px of noise; of what counts
  double target_gsd = 0;
  // Surface counts that two photos have at this ground sampling distance: target_gsd, or twice that
  // of the median point where that is more. Surface further away is background.
  double max_gsd = 0;
  bool complete = false;

  // Good share of all that the photos show, with and without points.
  double GoodOfShown() const { return good_share * (1 - hole_share); }
};

// A place kept by LivePlace has gaps: surfels that have gone, and pieces without width.
struct PlaceQuality {
  // Whether surface.surfels[surfel] counts. The ground of photos that look ahead goes on without
  // end and is seen flat.
  bool Counts(size_t surfel) const {
    return surfels[surfel].counts && !surface.surfels[surfel].is_ground;
  }

  Surface surface;
  std::vector<SurfelQuality> surfels;  // in the order of surface.surfels, each as a whole
  std::vector<Piece> pieces;
  Completeness completeness;
};

// Good share of each surfel's area; 0 if it has no pieces.
std::vector<double> GoodSharesOf(const PlaceQuality& place);

// LivePlace's first update. target_gsd: submap units a pixel; 0: twice that of the median point.
PlaceQuality AssessPlace(const GuidedMap& map, double target_gsd = 0);

}  // namespace skein
