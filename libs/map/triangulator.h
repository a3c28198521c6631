#pragma once

#include <cstddef>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "core/result.h"
#include "sfm/correspondence_graph.h"
#include "sfm/reconstruction.h"
#include "sfm/triangulation.h"

namespace skein {

// COLMAP's, with its defaults.
struct TriangulationOptions {
  double create_max_angle_error = 2.0;    // degrees, of the observations of a new point
  double continue_max_angle_error = 2.0;  // degrees, to continue a track
  double merge_max_reproj_error = 4.0;    // pixels, of all observations of both points
  double complete_max_reproj_error = 4.0;
  int complete_max_transitivity = 5;   // matches from a track's observation to a new one
  double min_angle = 1.5;              // degrees, between two rays of a new point
  bool ignore_two_view_tracks = true;  // no point of two keypoints without any other match
  // Images whose camera lies outside of these are left out (Camera::HasBogusParams).
  double min_focal_length_ratio = 0.1;
  double max_focal_length_ratio = 10.0;
  double max_extra_param = 1.0;

  Status Check() const;
};

// Triangulates along verified matches as COLMAP's IncrementalTriangulator does (Schoenberger and
// Frahm 2016, section 4.3). `graph` and `model` outlive it. Points whose tracks change count as
// modified. Functions throw std::invalid_argument on nonsensical options.
class Triangulator {
 public:
  Triangulator(const CorrespondenceGraph* graph, Reconstruction* model)
      : graph_(*graph), model_(*model) {}

  // Each keypoint of a registered image continues the track of a match, or starts a point with its
  // matches. Returns the number of observations added.
  size_t TriangulateImage(const TriangulationOptions& options, ImageId id);

  // Completes the tracks of the image's keypoints; starts points of keypoints whose matches observe
  // none. Returns the number of observations added.
  size_t CompleteImage(const TriangulationOptions& options, ImageId id);

  // Adds matched keypoints that see a track's point, and their matches in turn. Returns their
  // number.
  size_t CompleteTracks(const TriangulationOptions& options,
                        const std::unordered_set<Point3DId>& ids);

  // Joins points that matches connect and whose mean all observations see. Returns the number of
  // observations of the joined points.
  size_t MergeTracks(const TriangulationOptions& options, const std::unordered_set<Point3DId>& ids);

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

  void Begin(const TriangulationOptions& options);
  bool IsUsable(const TriangulationOptions& options, const Image& image);
  bool HasBogusParams(const TriangulationOptions& options, const Camera& camera);
  void FindMatches(const TriangulationOptions& options, ImageId id, Point2DIdx index);
  bool IsOfTwoViews(const TriangulationOptions& options, const Sight& sight) const;
  size_t Create(const TriangulationOptions& options, const std::vector<Sight>& sights);
  size_t StartPoint(const TriangulationLimits& limits, const std::vector<Sight>& sights);
  size_t Continue(const TriangulationOptions& options, const Sight& sight);
  size_t Complete(const TriangulationOptions& options, Point3DId id);
  void AddMatchesOf(const TriangulationOptions& options, Point3DId id, const TrackElement& from,
                    std::vector<TrackElement>* added);
  size_t Merge(const TriangulationOptions& options, Point3DId id);
  size_t MergeWith(const TriangulationOptions& options, Point3DId id, Point3DId other);
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
