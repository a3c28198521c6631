#include "benchmark/guidance/feedback_quality.h"

#include <algorithm>
#include <limits>

#include "benchmark/support/point_grid.h"

namespace skein {
namespace {

double NearestGsd(const GuidedMap& map, const GuidedPoint& point) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const uint32_t i : point.photos) {
    const GuidedPhoto& photo = map.photos[i];
    const double distance = (photo.cam_from_world.Centre() - point.xyz).norm();
    nearest = std::min(nearest, distance / map.cameras[photo.camera].FocalPx());
  }
  return nearest;
}

// Places of the values between their least and their greatest.
class Range {
 public:
  Range(const std::vector<TrackFigures>& tracks, double TrackFigures::*member) : member_(member) {
    for (const TrackFigures& t : tracks) {
      low_ = std::min(low_, t.*member);
      high_ = std::max(high_, t.*member);
    }
  }
  double Of(const TrackFigures& tracks) const {
    return high_ > low_ ? (tracks.*member_ - low_) / (high_ - low_) : 0;
  }

 private:
  double TrackFigures::*member_;
  double low_ = std::numeric_limits<double>::infinity(), high_ = -low_;
};

}  // namespace

double RadiusOfSurfel(const Surface& surface) { return 0.75 * surface.cell; }

std::vector<TrackFigures> TracksAround(const PoolMap& map, const Surface& surface) {
  const double radius = RadiusOfSurfel(surface);
  PointGrid grid(radius);
  std::vector<double> gsd;
  for (uint32_t i = 0; i < map.map.points.size(); ++i) {
    grid.Add(map.map.points[i].xyz, i);
    gsd.push_back(NearestGsd(map.map, map.map.points[i]));
  }
  std::vector<TrackFigures> tracks;
  for (const Surfel& surfel : surface.surfels) {
    TrackFigures sum;
    double count = 0;
    grid.ForNear(surfel.position, radius, [&](uint32_t i, const Eigen::Vector3d&) {
      sum.length += static_cast<double>(map.map.points[i].photos.size());
      sum.gsd += gsd[i];
      sum.error_px += map.error_px[i];
      ++count;
      return true;
    });
    count = std::max(count, 1.0);
    tracks.push_back({sum.length / count, sum.gsd / count, sum.error_px / count});
  }
  return tracks;
}

std::vector<double> FeedbackQuality(const std::vector<TrackFigures>& tracks) {
  const Range length(tracks, &TrackFigures::length), gsd(tracks, &TrackFigures::gsd),
      error(tracks, &TrackFigures::error_px);
  std::vector<double> quality;
  for (const TrackFigures& t : tracks) {
    quality.push_back(0.1 * (1 - gsd.Of(t)) + 0.8 * length.Of(t) + 0.1 * (1 - error.Of(t)));
  }
  return quality;
}

}  // namespace skein
