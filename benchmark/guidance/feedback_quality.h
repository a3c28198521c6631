// The quality measure of On-the-fly Feedback SfM (arXiv 2512.02375), for comparison: from what the
// tracks of a map alone tell.
#pragma once

#include <vector>

#include "benchmark/support/photo_pool.h"
#include "guidance/surface.h"

namespace skein {

// Means over the points around a surfel; zeros where there are none.
struct TrackFigures {
  double length = 0;    // photos of a track
  double gsd = 0;       // in the nearest photo, metres a pixel
  double error_px = 0;  // of reprojection
};

// How far around a surfel something is still its own.
double RadiusOfSurfel(const Surface& surface);

// In the order of surface.surfels.
std::vector<TrackFigures> TracksAround(const PoolMap& map, const Surface& surface);

// Q = 0.1 GSD + 0.8 mean track length + 0.1 reprojection error, each from 0 for the worst of the
// surfels to 1 for the best.
std::vector<double> FeedbackQuality(const std::vector<TrackFigures>& tracks);

}  // namespace skein
