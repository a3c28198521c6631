// Look-alike places: photos of another building of the same design fit a map perfectly where the
// two look alike. What tells them apart is what does not match: parts of a photo in which points of
// another photo should be seen and none is, although the photo has points of its own there, on the
// same surface. Where something stands before it they are nearer; where leaves or light changed,
// such parts are few. (The idea of missing correspondences: Zach et al. 2010, Heinly et al. 2014.)
// A point of one photo should be seen in another that looks at it from about the same direction and
// distance when it was recognised before across a change of direction as large as that.
#pragma once

#include <map>
#include <set>
#include <vector>

#include "map/scene_map.h"

namespace skein {

struct LookAlikeOptions {
  int num_columns = 24;  // cells of a photo
  int num_rows = 18;
  int min_points = 4;                // that should be seen, and keypoints: of a cell that counts
  double max_view_angle_deg = 12.0;  // between photos that should see the same
  double max_distance_ratio = 1.3;   // likewise
  int min_own_points = 3;            // of the photo in a cell, that tell how far it sees there
  double max_depth_ratio = 1.15;     // of one surface
  // Of the cells, those that are different. Of one place 0.00 to 0.01 in the mean, up to 0.05 for
  // pairs of photos; 0.4 of two buildings of one design.
  double max_different_share = 0.15;
  // Those in which nothing is seen: 0.01 to 0.1 in the mean, but up to 0.7 behind a tree. For
  // photos that there is reason to suspect.
  double max_missing_share = 0.4;
  int min_cells = 60;            // that a photo or two sides are judged by
  int min_different_cells = 60;  // by which a group of photos must be contradicted
  int min_missing_cells = 30;    // likewise, of a group with suspects
  int min_pair_cells = 20;       // of a pair with a suspect
  int max_neighbours = 10;       // photos with most matches that one is compared with
};

// Cells of one photo in which points of another should be seen.
struct CellVotes {
  int num_seen = 0;       // some are
  int num_missing = 0;    // none is
  int num_different = 0;  // of the missing: the photo sees other points on that surface
  int num_cells() const { return num_seen + num_missing; }
  void Add(const CellVotes& other);
};

bool ShowsAnotherPlace(const LookAlikeOptions& options, const CellVotes& votes);
bool MissesTooMuch(const LookAlikeOptions& options, const CellVotes& votes);

// Of a photo that is not registered, at a pose (cam_from_world) with a camera, with the points of
// its registered neighbours. Tells what is missing, never what is different: it has no points yet.
CellVotes CompareWithNeighbours(const LookAlikeOptions& options, const SceneMap& map,
                                ImageId image_id, const colmap::Camera& camera,
                                const Eigen::Matrix3x4d& cam_from_world);

// Registered photos of places that look alike and stand at the same spot of the map: photos are
// joined into groups along their verified pairs, those that see most of each other first, but never
// groups that show different places. Of these the one with the photo `first` stays, if that is
// registered, so that two maps never change places; else the largest. The photos of the others are
// returned, in ascending order. Visits all photos.
std::vector<ImageId> FindLookAlikes(const LookAlikeOptions& options, const SceneMap& map,
                                    ImageId first);

// What is suspected in a map.
struct Suspicion {
  std::set<ImageId> suspects;  // registered, with matches with photos of a place that looks alike
  // Photos that wait as they miss too much where their matches put them (cam_from_world): they
  // belong to those that they match most with, and tell them from those whose points they miss.
  std::map<ImageId, Eigen::Matrix3x4d> witnesses;
  bool Concerns(ImageId id) const { return suspects.count(id) > 0 || witnesses.count(id) > 0; }
  bool IsEmpty() const { return suspects.empty() && witnesses.empty(); }
};

// The same where FindLookAlikes finds none: photos are joined by their matches, and pairs that the
// suspicion concerns are judged by what is missing.
std::vector<ImageId> FindSuspectedLookAlikes(const LookAlikeOptions& options, const SceneMap& map,
                                             ImageId first, const Suspicion& suspicion);

// Between photos of two sides in one model, along the verified pairs of `map`, which has all of
// them (its own poses and points are not looked at).
CellVotes CompareSides(const LookAlikeOptions& options, const SceneMap& map,
                       const colmap::Reconstruction& model, const std::set<ImageId>& side1,
                       const std::set<ImageId>& side2);

}  // namespace skein
