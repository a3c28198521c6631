// Visually similar structures ("doppelgangers", Cai et al. 2023): a photo of another building of
// the same design fits a map in its matches. Points that are visible but unmatched tell the two
// apart (Zach et al. 2010, Heinly et al. 2014).
//
// Photo a is divided into cells. A point X of photo b is expected in a when X projects into a and
//
//   1/max_distance_ratio < |X - c_a| / |X - c_b| < max_distance_ratio,   c: camera centres,
//   angle(a, b) <= max_view_angle,       angle(u, v) at X between the rays to c_u and c_v,
//   some other photo t in X's track has angle(t, b) >= 0.75 angle(a, b).
//
// A cell counts with min_points expected points and as many keypoints. A cell is seen when a
// verified match ties one of its expected points to a, else missing. A missing cell is different
// when
//
//   1/max_depth_ratio < z_X / z_a < max_depth_ratio,
//
// z_X: median depth of its expected points, z_a: of the points that a observes there. An occluder
// is nearer, so its cell is missing, but not different. docs/methods/similar_structures.md
#pragma once

#include <map>
#include <set>
#include <vector>

#include "core/result.h"
#include "map/scene_map.h"

namespace skein {

struct SimilarStructuresOptions {
  int num_columns = 24;  // cells of a photo
  int num_rows = 18;
  int min_points = 4;                // expected points, and keypoints, of a cell that counts
  double max_view_angle_deg = 12.0;  // between the rays of two photos to an expected point
  double max_distance_ratio = 1.3;   // of the lengths of these rays
  int min_own_points = 3;            // observed by the photo in a cell, for its depth there
  double max_depth_ratio = 1.15;     // of one surface
  // different / (seen + missing). One place: 0.00 to 0.01 in the mean, up to 0.05 for a pair. Two
  // buildings of one design: 0.4.
  double max_different_share = 0.15;
  // missing / (seen + missing). One place: 0.01 to 0.1 in the mean, up to 0.7 behind a tree.
  // Therefore missing cells alone judge no photo: there must be other evidence.
  double max_missing_share = 0.4;
  int min_cells = 60;            // by which a photo or two sets of photos are judged
  int min_different_cells = 60;  // by which a group of photos must be contradicted
  int min_missing_cells = 30;    // the same for a group judged by missing cells
  int min_pair_cells = 20;       // of a pair judged by missing cells
  int max_neighbours = 10;       // registered photos with most matches, compared with a photo

  Status Check() const;
};

// Cells of one photo that count.
struct CellVotes {
  int num_seen = 0;
  int num_missing = 0;
  int num_different = 0;  // among the missing
  int num_cells() const { return num_seen + num_missing; }
  void Add(const CellVotes& other);
};

bool ShowsAnotherPlace(const SimilarStructuresOptions& options, const CellVotes& votes);
bool HasTooManyMissingCells(const SimilarStructuresOptions& options, const CellVotes& votes);

// Compares a photo that is not registered, at cam_from_world, with its registered neighbours. The
// photo has no points yet, so no cell is different.
CellVotes CompareWithNeighbours(const SimilarStructuresOptions& options, const SceneMap& map,
                                ImageId image_id, const Camera& camera,
                                const Matrix3x4d& cam_from_world);

// A registered photo as if it stood at cam_from_world, compared with another one. Its own depths
// are taken at its registered pose.
CellVotes CompareWithPhoto(const SimilarStructuresOptions& options, const SceneMap& map,
                           ImageId image_id, const Matrix3x4d& cam_from_world, ImageId other);

// Photos of another place than the map's, by different cells, ascending. Photos are joined into
// groups along their verified pairs, those with most seen cells first. Groups that show different
// places are never joined. The group with the photo `first` stays if that is registered, else the
// largest; the photos of the others are returned. So two maps never exchange their places. Visits
// all photos, with several threads.
std::vector<ImageId> FindPhotosOfAnotherPlace(const SimilarStructuresOptions& options,
                                              const SceneMap& map, ImageId first,
                                              int num_threads = 1);

// Photos that are judged by missing cells.
struct SimilarPlaceCandidates {
  // Photos that match photos of a visually similar place.
  std::set<ImageId> registered;
  // Photos with too many missing cells at the pose of their matches (cam_from_world). Such a photo
  // belongs to the photos it matches most, and contradicts those whose points it misses.
  std::map<ImageId, Matrix3x4d> waiting;
  bool Contains(ImageId id) const { return registered.count(id) > 0 || waiting.count(id) > 0; }
  bool IsEmpty() const { return registered.empty() && waiting.empty(); }
};

// The same by missing cells, where FindPhotosOfAnotherPlace finds none. Photos are joined by their
// matches. Pairs with a candidate are judged; only registered photos are returned.
std::vector<ImageId> FindPhotosOfAnotherPlaceByMissingCells(
    const SimilarStructuresOptions& options, const SceneMap& map, ImageId first,
    const SimilarPlaceCandidates& candidates);

// Sums the cells between photos of two sets in one model, along the verified pairs of `map`. The
// map must hold all of these photos; its own poses and points are not used.
CellVotes ComparePhotoSets(const SimilarStructuresOptions& options, const SceneMap& map,
                           const Reconstruction& model, const std::set<ImageId>& photos1,
                           const std::set<ImageId>& photos2);

}  // namespace skein
