#pragma once

#include <cstddef>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "sfm/correspondence_graph.h"
#include "sfm/reconstruction.h"
#include "sfm/triangulation.h"

namespace skein {

// Triangulates along verified matches as COLMAP's IncrementalTriangulator does (Schoenberger and
// Frahm 2016, section 4.3). `graph` and `model` outlive it. Points whose tracks change count as
// modified. Two keypoints without any other match make no point. Images whose camera has impossible
// intrinsics (limits.h) are left out.
class Triangulator {
 public:
  // COLMAP's defaults.
  static constexpr double kMaxCreateErrorDeg = 2.0;  // of the observations of a new point
  static constexpr int kMaxTransitivity = 5;  // matches from a track's observation to a new one

  Triangulator(const CorrespondenceGraph* graph, Reconstruction* model)
      : graph_(*graph), model_(*model) {}

  // Each keypoint of a registered image continues the track of a match, or starts a point with its
  // matches. Returns the number of observations added.
  size_t TriangulateImage(ImageId id);

  // Starts points of the image's keypoints that observe none and whose matches observe none.
  // Returns the number of observations added.
  size_t StartPoints(ImageId id);

  // Adds matched keypoints that see a track's point, and their matches in turn. Returns their
  // number.
  size_t CompleteTracks(const std::unordered_set<Point3DId>& ids);

  // Joins points that matches connect and whose mean all observations see. Returns the number of
  // observations of the joined points.
  size_t MergeTracks(const std::unordered_set<Point3DId>& ids);

  void AddModifiedPoint3D(Point3DId id) { modified_.insert(id); }
  // Points that are there.
  const std::unordered_set<Point3DId>& GetModifiedPoints3D();
  void ClearModifiedPoints3D() { modified_.clear(); }

 private:
  // A keypoint of a registered image with a possible camera.
  struct Sight {
    const Image* image;
    const Camera* camera;
    Point2DIdx index;

    const Point2D& Keypoint() const { return image->Point2D(index); }
    TrackElement Element() const { return {image->ImageId(), index}; }
  };

  void Begin();
  bool IsUsable(const Image& image);
  bool HasBogusParams(const Camera& camera);
  void FindMatches(ImageId id, Point2DIdx index);
  bool IsOfTwoViews(const Sight& sight) const;
  size_t Create(const std::vector<Sight>& sights);
  size_t StartPoint(const TriangulationLimits& limits, const std::vector<Sight>& sights);
  size_t Continue(const Sight& sight);
  size_t Complete(Point3DId id);
  void AddMatchesOf(Point3DId id, const TrackElement& from, std::vector<TrackElement>* added);
  size_t Merge(Point3DId id);
  size_t MergeWith(Point3DId id, Point3DId other);
  bool IsTried(Point3DId id, Point3DId other) const;
  bool IsSeenAt(const TrackElement& element, const Eigen::Vector3d& xyz, double max_error_px) const;

  const CorrespondenceGraph& graph_;
  Reconstruction& model_;
  std::unordered_set<Point3DId> modified_;
  // Caches of one call: whether a camera is out of range, pairs of points that were tried, the
  // matches of one keypoint.
  std::unordered_map<CameraId, bool> is_bogus_;
  std::unordered_map<Point3DId, std::unordered_set<Point3DId>> tried_;
  std::vector<Sight> matches_;
};

}  // namespace skein
