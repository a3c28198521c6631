#include "map/track_completion.h"

#include <algorithm>
#include <unordered_set>

#include "core/limits.h"
#include "core/threads.h"
#include "map/map_access.h"
#include "sfm/reprojection.h"

namespace skein {
namespace {

std::unordered_set<Point3DId> ModifiedShortTracks(SceneMap* map) {
  std::unordered_set<Point3DId> points;
  for (const Point3DId id : MapAccess::Triangulator(map).GetModifiedPoints3D()) {
    if (!IsLongTrack(*map, id)) points.insert(id);
  }
  return points;
}

bool IsSeenAt(const Reconstruction& reconstruction, const TrackElement& element,
              const Eigen::Vector3d& xyz, double max_error_px) {
  const Image& image = reconstruction.Image(element.image_id);
  return CalculateSquaredReprojectionError(
             image.Point2D(element.point2D_idx).XY(), xyz, image.Qvec(), image.Tvec(),
             reconstruction.Camera(image.CameraId())) <= max_error_px * max_error_px;
}

// Whether the images of both see the point between the two, nearer to the one with the longer
// track.
bool AreOne(const Reconstruction& reconstruction, Point3DId id1, Point3DId id2) {
  const Point3D& point1 = reconstruction.Point3D(id1);
  const Point3D& point2 = reconstruction.Point3D(id2);
  const double length1 = static_cast<double>(point1.Track().Length());
  const double length2 = static_cast<double>(point2.Track().Length());
  const Eigen::Vector3d xyz =
      (length1 * point1.XYZ() + length2 * point2.XYZ()) / (length1 + length2);
  for (const Point3D* point : {&point1, &point2}) {
    for (const TrackElement& element : point->Track().Elements()) {
      if (!IsSeenAt(reconstruction, element, xyz, limits::kMaxErrorPx)) return false;
    }
  }
  return true;
}

// What COLMAP's Complete and Merge would change of a point.
struct Gain {
  bool completes = false;  // a match leads to a free keypoint that sees it
  bool merges = false;     // a match leads to a point of a larger id that is the same one
};

// Only reads the map.
Gain GainOf(const SceneMap& map, Point3DId id) {
  const Reconstruction& reconstruction = map.reconstruction();
  Gain gain;
  if (!reconstruction.ExistsPoint3D(id)) return gain;
  const Point3D& point = reconstruction.Point3D(id);
  std::vector<Point3DId> tried;
  const auto is_twin = [&](Point3DId other) {
    if (other <= id || std::find(tried.begin(), tried.end(), other) != tried.end()) return false;
    tried.push_back(other);
    return AreOne(reconstruction, id, other);
  };
  for (const TrackElement& element : point.Track().Elements()) {
    for (const auto& match :
         map.graph().FindCorrespondences(element.image_id, element.point2D_idx)) {
      const Image& image = reconstruction.Image(match.image_id);
      if (!image.IsRegistered()) continue;
      const Point2D& point2D = image.Point2D(match.point2D_idx);
      if (point2D.HasPoint3D()) {
        gain.merges = gain.merges || is_twin(point2D.Point3DId());
      } else {
        gain.completes = gain.completes ||
                         IsSeenAt(reconstruction, TrackElement(match.image_id, match.point2D_idx),
                                  point.XYZ(), limits::kMaxErrorPx);
      }
      if (gain.completes && gain.merges) return gain;
    }
  }
  return gain;
}

bool Merge(Point3DId id1, Point3DId id2, SceneMap* map) {
  Reconstruction& reconstruction = MapAccess::Model(map);
  if (!AreOne(reconstruction, id1, id2)) return false;
  MapAccess::Triangulator(map).AddModifiedPoint3D(reconstruction.MergePoints3D(id1, id2));
  return true;
}

// What matches tie to a point with a long track that the new photo sees.
class LongTrack {
 public:
  LongTrack(ImageId image_id, Point2DIdx index, SceneMap* map)
      : image_id_(image_id), index_(index), map_(*map) {}

  void Merge() const {
    std::unordered_set<Point3DId> tried;
    for (const auto& match : map_.graph().FindCorrespondences(image_id_, index_)) {
      const Image& other = map_.reconstruction().Image(match.image_id);
      const Point2D& point2D = other.Point2D(match.point2D_idx);
      if (!point2D.HasPoint3D() || point2D.Point3DId() == id()) continue;
      if (!tried.insert(point2D.Point3DId()).second) continue;
      skein::Merge(id(), point2D.Point3DId(), &map_);
    }
  }

  // Follows the matches of what it adds, too.
  void Complete() const {
    std::vector<TrackElement> ends{{image_id_, index_}};
    for (int i = 0; i < Triangulator::kMaxTransitivity && !ends.empty(); ++i) {
      std::vector<TrackElement> added;
      for (const TrackElement& end : ends) AddMatchesOf(end, &added);
      ends.swap(added);
    }
  }

 private:
  Point3DId id() const {
    return map_.reconstruction().Image(image_id_).Point2D(index_).Point3DId();
  }

  void AddMatchesOf(const TrackElement& element, std::vector<TrackElement>* added) const {
    Reconstruction& reconstruction = MapAccess::Model(&map_);
    for (const auto& match :
         map_.graph().FindCorrespondences(element.image_id, element.point2D_idx)) {
      const Image& other = reconstruction.Image(match.image_id);
      if (!other.IsRegistered() || other.Point2D(match.point2D_idx).HasPoint3D()) continue;
      const TrackElement found(match.image_id, match.point2D_idx);
      if (!IsSeenAt(reconstruction, found, reconstruction.Point3D(id()).XYZ(),
                    limits::kMaxErrorPx)) {
        continue;
      }
      reconstruction.AddObservation(id(), found);
      added->push_back(found);
    }
    if (!added->empty()) MapAccess::Triangulator(&map_).AddModifiedPoint3D(id());
  }

  const ImageId image_id_;
  const Point2DIdx index_;
  SceneMap& map_;
};

template <typename Function>
void ForEachLongTrack(ImageId image_id, SceneMap* map, const Function& function) {
  const Image& image = map->reconstruction().Image(image_id);
  for (Point2DIdx i = 0; i < image.NumPoints2D(); ++i) {
    if (!image.Point2D(i).HasPoint3D() || !IsLongTrack(*map, image.Point2D(i).Point3DId()))
      continue;
    function(LongTrack(image_id, i, map));
  }
}

}  // namespace

void CompleteLocally(ImageId new_image, SceneMap* map) {
  Triangulator& triangulator = MapAccess::Triangulator(map);
  triangulator.MergeTracks(ModifiedShortTracks(map));
  ForEachLongTrack(new_image, map, [](const LongTrack& point) { point.Merge(); });
  triangulator.CompleteTracks(ModifiedShortTracks(map));
  ForEachLongTrack(new_image, map, [](const LongTrack& point) { point.Complete(); });
  triangulator.StartPoints(new_image);
}

size_t GrowTracks(int num_threads, const std::vector<Point3DId>& points, SceneMap* map) {
  std::vector<Gain> gains(points.size());
  ForEachOnThreads(num_threads, points.size(),
                   [&](size_t i) { gains[i] = GainOf(*map, points[i]); });
  std::unordered_set<Point3DId> completing, merging;
  for (size_t i = 0; i < points.size(); ++i) {
    if (gains[i].completes) completing.insert(points[i]);
    // What a point gains may lead on to its twin.
    if (gains[i].completes || gains[i].merges) merging.insert(points[i]);
  }
  Triangulator& triangulator = MapAccess::Triangulator(map);
  const size_t num_completed = triangulator.CompleteTracks(completing);
  return num_completed + triangulator.MergeTracks(merging);
}

}  // namespace skein
