// A model's position on the earth, from the GPS positions of its photos.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "geometry/sim3_similarity.h"

namespace skein {

struct GeodeticPosition {  // WGS84
  double latitude_deg = 0;
  double longitude_deg = 0;
  std::optional<double> altitude_m;  // as the device reports it
};

// Finite, within the ranges of angles, and not 0, 0, which devices write for "unknown".
bool IsPlausible(const GeodeticPosition& position);

// Metres to the east, north and up of `origin`, up along the ellipsoid's normal there. A position
// without altitude is taken at that of the origin, an origin without altitude at 0.
Eigen::Vector3d EnuFromGeodetic(const GeodeticPosition& origin, const GeodeticPosition& position);

// Latitude and longitude of the plausible position that is nearest to the median of all, so that a
// few absurd ones don't matter and the origin lies where a photo was taken. The median of the known
// altitudes; none where none is known. 0, 0 without a plausible position.
GeodeticPosition EnuOrigin(const std::vector<GeodeticPosition>& positions);

// Photos with a position that a georeference takes: one more than must agree, so that a wrong one
// shows.
inline constexpr int kMinPositions = 5;
// A residual of an inlier is smaller, in sigmas: 99 % of 2 and of 3 dimensions.
inline constexpr double kInlierSigmas[] = {3.03, 3.37};

// A registered photo that carries a position.
struct GeoPhoto {
  std::string name;
  CameraPose cam_from_world;  // in the model's frame
  GeodeticPosition position;
};

struct GeoResidual {
  std::string name;
  Eigen::Vector3d enu_m = Eigen::Vector3d::Zero();  // the model's minus the device's
  bool has_altitude = false;                        // else enu_m.z() is 0
  bool inlier = false;
};

struct Georeference {
  bool ok = false;
  std::string reason;  // why not, for a person
  // Without altitude: heights in ENU are above the median camera.
  GeodeticPosition origin;
  Similarity enu_from_model;
  std::vector<GeoResidual> residuals;  // one for each photo with a plausible position
  int num_inliers = 0;
  bool altitudes_used = true;     // of photos that have one; else inliers and sigma are horizontal
  double sigma_m = 0;             // of a position, per axis, from the inliers
  double rotation_sigma_deg = 0;  // about the worst axis
  double scale_sigma = 0;         // relative
};

// The similarity from the model's frame to ENU at `origin`.
//  - Least trimmed squares (Rousseeuw and Van Driessen 2006) gives a start and the noise. Nothing
//    is assumed about the device; nearly half of the positions may be wrong.
//  - Iteratively reweighted least squares with Cauchy weights over all positions refines it.
//    Both with the photos that carry an altitude.
//  - The same is done with the horizontal positions of all photos. Up is then what the cameras say:
//    held level, or looking straight down. The altitudes give the height.
// The residuals tell which of the two wins: altitudes may drift, and then tilt the model.
// Too few altitudes count as none. Refused, with a reason: too few positions; too few that agree.
// Also camera centres in a spot or on a line at the scale of the noise, as they leave scale or
// rotation open. The reason is that of CauseOfRefusal (geometry/georeference_refusal.h).
// Deterministic.
Georeference EstimateGeoreference(const GeodeticPosition& origin,
                                  const std::vector<GeoPhoto>& photos);

}  // namespace skein
