#pragma once

#include <cstddef>
#include <vector>

#include "disambiguation/photo_groups.h"
#include "map/scene_map.h"

namespace skein {

constexpr int kMinContradiction = 30;  // matches by which contradiction must outweigh agreement

// Pairs with a smaller part of the inliers of their photos' strongest pairs contradict nobody. Such
// weak pairs are as often false, of an object that two places share
// (docs/experiments/false_pairs.md).
constexpr double kMinPairShare = 0.03;

constexpr size_t kMaxPhotosAround = 100;  // that FindMisplacedAround looks at

// Votes of the matches of two registered photos on their poses: a match agrees if one photo's point
// projects into the other within limits::kMaxPoseErrorPx of the matched keypoint. A match counts if
// both keypoints have a point. A weak pair (kMinPairShare) has contradict = 0.
Votes CountVotes(const SceneMap& map, ImageId id1, ImageId id2);

// Votes of the matches whose two keypoints both have points: a match agrees if they have one point
// in common, and contradicts if each has its own. In a torn pair (IsTorn) a match of two points
// that a photo shows apart has no vote: it is false, as of two windows in a row, however right the
// poses.
Votes CountCommonPoints(const SceneMap& map, ImageId id1, ImageId id2);

// By its CountCommonPoints. If a part of a map has another scale than the rest, or is bent, its
// photos have points of their own for what both parts see, and still reproject well. In good maps
// one match in 4 to 12 is so, of all pairs alike.
bool IsTorn(const Votes& common_points);

// Whether these verified pairs of registered photos together are of similar structures, as of two
// gables of one house: they contradict a map that is right. The first photo of each pair is placed
// at the pose by its matches with the second photo, and the two are compared
// (disambiguation/similar_structures.h). Costs a pose estimation a pair.
bool AreOfSimilarStructures(const SceneMap& map, const ImagePairs& pairs);

// AreOfSimilarStructures of the pairs by which registered photos outside of `photos` contradict
// these. `photos`: registered, ascending.
bool OnlySimilarStructuresContradict(const SceneMap& map, const std::vector<ImageId>& photos);

// Registered photos in parts of the map that stand in the wrong place. Repeated structure can tie a
// photo to a wrong spot by a few matches that agree, and then all that grows from it. Once the
// right neighbours are registered, many more matches between the two parts contradict. Photos are
// joined along their verified pairs, those with most agreeing matches first. Two groups with more
// contradicting than agreeing matches are never joined. If groups contradict each other, the
// largest stays. The photos of the others are returned, ascending. Visits all pairs.
std::vector<ImageId> FindMisplaced(const SceneMap& map);

// The same among the registered photos nearest to `center` along verified pairs, at most
// `max_photos`. Its cost is independent of the map's size.
std::vector<ImageId> FindMisplacedAround(const SceneMap& map, ImageId center,
                                         size_t max_photos = kMaxPhotosAround);

}  // namespace skein
