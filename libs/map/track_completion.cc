#include "map/track_completion.h"

#include <algorithm>
#include <unordered_set>

#include "base/projection.h"
#include "core/threads.h"
#include "map/filters.h"
#include "map/map_access.h"

namespace skein {
namespace {

using TriangulatorOptions = colmap::IncrementalTriangulator::Options;

std::unordered_set<Point3DId> ModifiedShortTracks(SceneMap* map) {
  std::unordered_set<Point3DId> points;
  for (const Point3DId id : MapAccess::Triangulator(map).GetModifiedPoints3D()) {
    if (!IsLongTrack(*map, id)) points.insert(id);
  }
  return points;
}

bool IsSeenAt(const colmap::Reconstruction& reconstruction, const colmap::TrackElement& element,
              const Eigen::Vector3d& xyz, double max_error_px) {
  const colmap::Image& image = reconstruction.Image(element.image_id);
  return colmap::CalculateSquaredReprojectionError(
             image.Point2D(element.point2D_idx).XY(), xyz, image.Qvec(), image.Tvec(),
             reconstruction.Camera(image.CameraId())) <= max_error_px * max_error_px;
}

// Whether the images of both see the point between the two, nearer to the one with the longer
// track.
bool AreOne(const colmap::Reconstruction& reconstruction, double max_error_px, Point3DId id1,
            Point3DId id2) {
  const colmap::Point3D& point1 = reconstruction.Point3D(id1);
  const colmap::Point3D& point2 = reconstruction.Point3D(id2);
  const double length1 = static_cast<double>(point1.Track().Length());
  const double length2 = static_cast<double>(point2.Track().Length());
  const Eigen::Vector3d xyz =
      (length1 * point1.XYZ() + length2 * point2.XYZ()) / (length1 + length2);
  for (const colmap::Point3D* point : {&point1, &point2}) {
    for (const colmap::TrackElement& element : point->Track().Elements()) {
      if (!IsSeenAt(reconstruction, element, xyz, max_error_px)) return false;
    }
  }
  return true;
}

// Whether Complete or Merge of COLMAP's would change the point. Only reads the map.
class PointGain {
 public:
  PointGain(const TriangulatorOptions& options, const SceneMap& map)
      : options_(options), map_(map), reconstruction_(map.reconstruction()) {}

  bool HasFreeObservation(Point3DId id) const {
    const Eigen::Vector3d& xyz = reconstruction_.Point3D(id).XYZ();
    return AnyMatch(id, [&](const colmap::TrackElement& match, const colmap::Point2D& point2D) {
      return !point2D.HasPoint3D() &&
             IsSeenAt(reconstruction_, match, xyz, options_.complete_max_reproj_error);
    });
  }

  // With one of a larger id: of two points one is found.
  bool HasTwin(Point3DId id) const {
    std::vector<Point3DId> tried;
    return AnyMatch(id, [&](const colmap::TrackElement&, const colmap::Point2D& point2D) {
      const Point3DId other = point2D.Point3DId();
      if (!point2D.HasPoint3D() || other <= id) return false;
      if (std::find(tried.begin(), tried.end(), other) != tried.end()) return false;
      tried.push_back(other);
      return AreOne(reconstruction_, options_.merge_max_reproj_error, id, other);
    });
  }

 private:
  // Of the point's observations, with registered photos.
  template <typename Predicate>
  bool AnyMatch(Point3DId id, const Predicate& predicate) const {
    for (const colmap::TrackElement& element : reconstruction_.Point3D(id).Track().Elements()) {
      for (const auto& match :
           map_.graph().FindCorrespondences(element.image_id, element.point2D_idx)) {
        const colmap::Image& image = reconstruction_.Image(match.image_id);
        if (image.IsRegistered() &&
            predicate(colmap::TrackElement(match.image_id, match.point2D_idx),
                      image.Point2D(match.point2D_idx))) {
          return true;
        }
      }
    }
    return false;
  }

  const TriangulatorOptions& options_;
  const SceneMap& map_;
  const colmap::Reconstruction& reconstruction_;
};

template <typename Predicate>
std::unordered_set<Point3DId> PointsWith(int num_threads, const SceneMap& map,
                                         const Predicate& predicate) {
  const std::vector<Point3DId> ids = AllPoints(map);
  std::vector<char> has(ids.size());
  ForEachOnThreads(num_threads, ids.size(), [&](size_t i) { has[i] = predicate(ids[i]); });
  std::unordered_set<Point3DId> found;
  for (size_t i = 0; i < ids.size(); ++i) {
    if (has[i]) found.insert(ids[i]);
  }
  return found;
}

bool Merge(double max_error_px, Point3DId id1, Point3DId id2, SceneMap* map) {
  colmap::Reconstruction& reconstruction = MapAccess::Model(map);
  if (!AreOne(reconstruction, max_error_px, id1, id2)) return false;
  MapAccess::Triangulator(map).AddModifiedPoint3D(reconstruction.MergePoints3D(id1, id2));
  return true;
}

// What matches tie to a point with a long track that the new photo sees.
class LongTrack {
 public:
  LongTrack(const TriangulatorOptions& options, ImageId image_id, Point2DIdx index, SceneMap* map)
      : options_(options), image_id_(image_id), index_(index), map_(*map) {}

  void Merge() const {
    std::unordered_set<Point3DId> tried;
    for (const auto& match : map_.graph().FindCorrespondences(image_id_, index_)) {
      const colmap::Image& other = map_.reconstruction().Image(match.image_id);
      const colmap::Point2D& point2D = other.Point2D(match.point2D_idx);
      if (!point2D.HasPoint3D() || point2D.Point3DId() == id()) continue;
      if (!tried.insert(point2D.Point3DId()).second) continue;
      skein::Merge(options_.merge_max_reproj_error, id(), point2D.Point3DId(), &map_);
    }
  }

  // Follows the matches of what it adds, too.
  void Complete() const {
    std::vector<colmap::TrackElement> ends{{image_id_, index_}};
    for (int i = 0; i < options_.complete_max_transitivity && !ends.empty(); ++i) {
      std::vector<colmap::TrackElement> added;
      for (const colmap::TrackElement& end : ends) AddMatchesOf(end, &added);
      ends.swap(added);
    }
  }

 private:
  Point3DId id() const {
    return map_.reconstruction().Image(image_id_).Point2D(index_).Point3DId();
  }

  void AddMatchesOf(const colmap::TrackElement& element,
                    std::vector<colmap::TrackElement>* added) const {
    colmap::Reconstruction& reconstruction = MapAccess::Model(&map_);
    for (const auto& match :
         map_.graph().FindCorrespondences(element.image_id, element.point2D_idx)) {
      const colmap::Image& other = reconstruction.Image(match.image_id);
      if (!other.IsRegistered() || other.Point2D(match.point2D_idx).HasPoint3D()) continue;
      const colmap::TrackElement found(match.image_id, match.point2D_idx);
      if (!IsSeenAt(reconstruction, found, reconstruction.Point3D(id()).XYZ(),
                    options_.complete_max_reproj_error)) {
        continue;
      }
      reconstruction.AddObservation(id(), found);
      added->push_back(found);
    }
    if (!added->empty()) MapAccess::Triangulator(&map_).AddModifiedPoint3D(id());
  }

  const TriangulatorOptions& options_;
  const ImageId image_id_;
  const Point2DIdx index_;
  SceneMap& map_;
};

template <typename Function>
void ForEachLongTrack(const TriangulatorOptions& options, ImageId image_id, SceneMap* map,
                      const Function& function) {
  const colmap::Image& image = map->reconstruction().Image(image_id);
  for (Point2DIdx i = 0; i < image.NumPoints2D(); ++i) {
    if (!image.Point2D(i).HasPoint3D() || !IsLongTrack(*map, image.Point2D(i).Point3DId()))
      continue;
    function(LongTrack(options, image_id, i, map));
  }
}

}  // namespace

void CompleteLocally(const TriangulatorOptions& options, ImageId new_image, SceneMap* map) {
  colmap::IncrementalTriangulator& triangulator = MapAccess::Triangulator(map);
  triangulator.MergeTracks(options, ModifiedShortTracks(map));
  ForEachLongTrack(options, new_image, map, [](const LongTrack& point) { point.Merge(); });
  triangulator.CompleteTracks(options, ModifiedShortTracks(map));
  ForEachLongTrack(options, new_image, map, [](const LongTrack& point) { point.Complete(); });
  TriangulatorOptions creating = options;
  creating.complete_max_transitivity = 0;  // the photo's tracks are complete
  triangulator.CompleteImage(creating, new_image);
}

size_t GrowAllTracks(const TriangulatorOptions& options, int num_threads, SceneMap* map) {
  const PointGain gain(options, *map);
  size_t num_changed = map->CompleteTracks(
      options,
      PointsWith(num_threads, *map, [&](Point3DId id) { return gain.HasFreeObservation(id); }));
  num_changed += map->MergeTracks(
      options, PointsWith(num_threads, *map, [&](Point3DId id) { return gain.HasTwin(id); }));
  return num_changed;
}

}  // namespace skein
