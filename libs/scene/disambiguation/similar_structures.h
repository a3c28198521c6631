// Visually similar structures ("doppelgangers", Cai et al. 2023): a photo of another building of
// the same design fits a map in its matches. Points that are visible but unmatched tell the two
// apart (Zach et al. 2010, Heinly et al. 2014).
//
// Photo a is divided into cells. A point X of photo b is expected in a when X projects into a and
//
//   1/1.3 < |X - c_a| / |X - c_b| < 1.3,   c: camera centres,
//   angle(a, b) <= 12 degrees,             angle(u, v) at X between the rays to c_u and c_v,
//   some other photo t in X's track has angle(t, b) >= 0.75 angle(a, b).
//
// A cell counts with 4 expected points and as many keypoints. A cell is seen when a
// verified match ties one of its expected points to a, else missing. A missing cell is different
// when
//
//   1/1.15 < z_X / z_a < 1.15,
//
// z_X: median depth of its expected points, z_a: of the points that a observes there. An occluder
// is nearer, so its cell is missing, but not different. docs/methods/similar_structures.md
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "core/result.h"
#include "map/scene_map.h"

namespace skein {

// Cells by which a photo or two sets of photos are judged.
constexpr int kMinCells = 60;

// Cells of one photo that count.
struct CellVotes {
  int num_seen = 0;
  int num_missing = 0;
  int num_different = 0;  // among the missing
  int num_cells() const { return num_seen + num_missing; }
  void Add(const CellVotes& other);
};

// False with fewer than `min_cells` cells.
bool ShowsAnotherPlace(const CellVotes& votes, int min_cells = kMinCells);
bool HasTooManyMissingCells(const CellVotes& votes, int min_cells = kMinCells);

// Compares a photo that is not registered, at cam_from_world, with its registered neighbours. The
// photo has no points yet, so no cell is different.
CellVotes CompareWithNeighbours(const SceneMap& map, ImageId image_id, const Camera& camera,
                                const Matrix3x4d& cam_from_world);

// A registered photo as if it stood at cam_from_world, compared with another one. Its own depths
// are taken at its registered pose.
CellVotes CompareWithPhoto(const SceneMap& map, ImageId image_id, const Matrix3x4d& cam_from_world,
                           ImageId other);

// Photos of another place than the map's, by different cells, ascending. Photos are joined into
// groups along their verified pairs, those with most seen cells first. Groups that show different
// places are never joined. The group with the photo `first` stays if that is registered, else the
// largest; the photos of the others are returned. So two maps never exchange their places. Visits
// all photos, with several threads.
std::vector<ImageId> FindPhotosOfAnotherPlace(const SceneMap& map, ImageId first,
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
    const SceneMap& map, ImageId first, const SimilarPlaceCandidates& candidates);

// Whether two sets of photos show different places, although one model holds both: photos of one
// object that two places share fit well together. Each pair of photos across with 20 cells has a
// vote, and most must say so. A pair says so by more than 0.15 different cells, or by a share of
// missing ones above the 95th percentile of the pairs within the sets; that counts as 0.2 to 0.4.
// Trees, zoom and light leave cells of single pairs without a match: in a crowd's photos of one
// statue one pair in eight misses 0.4. Rooms that share an object: 7 of 7 pairs across, none of 46
// within.
struct PlacesOfTwoSets {
  bool differ = false;
  int num_votes = 0;   // of pairs; 0 as well if all pairs together have fewer than kMinCells cells
  std::string reason;  // "" if they don't
};

// Along the verified pairs of `map`, which must hold all of these photos; its own poses and points
// are not used.
PlacesOfTwoSets ComparePlaces(const SceneMap& map, const Reconstruction& model,
                              const std::set<ImageId>& photos1, const std::set<ImageId>& photos2);

// Cells of a pair in one model, both ways, as ComparePlaces counts them.
CellVotes ComparePair(const SceneMap& map, const Reconstruction& model, ImageId id1, ImageId id2);

struct DividedPhotos {
  std::set<ImageId> of_first, of_second;
};

// Photos of a merged model, by the one of its two models that they belong to. `first`, `second`:
// the photos of the two. A photo of both belongs to that with more of its verified matches: in the
// wrong map, by an object that two places have in common, it has few. Costs the pairs of the merged
// model's photos.
DividedPhotos DividePhotos(const SceneMap& map, const std::set<ImageId>& first,
                           const std::set<ImageId>& second, const Reconstruction& merged);

// For a merge, before the models are fused: in each submap the shared photos are compared with the
// photos of that submap alone. An error if they are not of one place, as both submaps are. Each
// model is in its own frame; `shared` is registered in both.
//
// Cells are joined 3 x 3, as the points of small submaps are sparse. Measured, num_different of
// all: two places with one facade 0.32 to 0.51, one place at most 0.014. At one point a cell of 24
// x 18 both are below 0.03.
Status CheckSharedPhotos(const Reconstruction& target, const Reconstruction& source,
                         const std::set<ImageId>& shared);

}  // namespace skein
