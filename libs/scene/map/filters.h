#pragma once

#include <vector>

#include "bundle/bundle.h"
#include "core/limits.h"
#include "map/scene_map.h"

namespace skein {

// Removes observations of the bundle with too large an error (limits::kMaxErrorPx). Then removes
// its points with less than two observations or too small a triangulation angle
// (limits::kMinTriangulationAngleDeg). Sets the mean error of points whose
// observations are all in the bundle. `bundle` must be solved and applied to the map. Returns the
// number of removed observations.
int FilterBundle(const Bundle& bundle, SceneMap* map);

// The same for given points with all their observations.
int FilterPoints(const std::vector<Point3DId>& points, SceneMap* map,
                 double max_error_px = limits::kMaxErrorPx);
int FilterPoints(const std::vector<Point3DId>& points, Reconstruction* model,
                 double max_error_px = limits::kMaxErrorPx);

// Leaves points with small angles. While a focal length that was guessed too long gets shorter, all
// angles get smaller: a map of little parallax that is filtered by angles in each round of its last
// adjustment loses its points, and then its photos.
int FilterObservations(const std::vector<Point3DId>& points, SceneMap* map);

// Removes the observations of these photos that are nearer than a hundredth of the median depth of
// their photo: no lens is sharp at both. False matches of two photos alone fit best if the photos
// and their points shrink to one spot; the expected error is unknown then. `photos`: registered.
// Returns the number of removed observations.
int FilterNearPoints(const std::vector<ImageId>& photos, SceneMap* map);

// Removes what no third photo confirms and does not fit well. A false match is on the epipolar line
// by chance, so the errors of such a point of two photos are spread over the whole limit. The rows
// and columns of a right one have a standard deviation sigma, so the sum of its squared errors is
// sigma^2 chi^2 of 1 degree of freedom (Hartley and Zisserman 2004, section 4.7.1). A point stays
// if the sum is below the 99th percentile of that. sigma^2 is that of the points of more photos:
// the sum of their squared errors, divided by 2n - 3 for each point of n photos. Without these
// nothing is removed. Returns the number of removed points.
int FilterPointsOfTwoPhotos(SceneMap* map);

// Ascending ids of all points, for FilterPoints.
std::vector<Point3DId> AllPoints(const SceneMap& map);

// Whether two of the track's images see the point under at least this angle.
bool HasTriangulationAngle(const Reconstruction& reconstruction, const Point3D& point,
                           double min_angle_rad);

}  // namespace skein
