#include "disambiguation/similar_structures.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <unordered_map>
#include <utility>

#include "core/angles.h"
#include "core/limits.h"
#include "core/statistics.h"
#include "core/threads.h"
#include "disambiguation/photo_groups.h"

namespace skein {
namespace {

// angle(t, b) / angle(a, b) from which on photo t shows that the point is recognised in a.
constexpr double kAngleCover = 0.75;
constexpr int kMinCommonPoints = 15;       // of two photos, for them to be compared
constexpr int kMinExpectedPoints = 4;      // and keypoints, of a cell that counts
constexpr double kMaxViewAngleDeg = 12.0;  // between the rays of two photos to an expected point
constexpr double kMaxDistanceRatio = 1.3;  // of the lengths of these rays
constexpr int kMinOwnPoints = 3;           // observed by the photo in a cell, for its depth there
constexpr double kMaxDepthRatio = 1.15;    // of one surface
// different / (seen + missing). One place: 0.00 to 0.01 in the mean, up to 0.05 for a pair. Two
// buildings of one design: 0.4.
constexpr double kMaxDifferentShare = 0.15;
// missing / (seen + missing). One place: 0.01 to 0.1 in the mean, up to 0.7 behind a tree.
// Therefore missing cells alone judge no photo: there must be other evidence.
constexpr double kMaxMissingShare = 0.4;
constexpr int kMinDifferentCells = 60;  // by which a group of photos must be contradicted
constexpr int kMinMissingCells = 30;    // the same for a group judged by missing cells
constexpr int kMinPairCells = 20;       // of a pair judged by missing cells
constexpr size_t kMaxNeighbours = 10;  // registered photos with most matches, compared with a photo

// Cells of a photo.
struct CellGrid {
  int num_columns, num_rows;
};
constexpr CellGrid kGrid = {24, 18};
constexpr CellGrid kSharedGrid = {8, 6};  // of shared photos (CheckSharedPhotos)

double AngleBetween(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

// Points that verified matches with registered photos tie to a photo, sorted.
std::vector<Point3DId> MatchedPoints(const CorrespondenceGraph* graph, const Reconstruction& model,
                                     ImageId image_id) {
  std::vector<Point3DId> points;
  const Image& image = model.Image(image_id);
  for (Point2DIdx i = 0; i < image.NumPoints2D(); ++i) {
    if (image.Point2D(i).HasPoint3D()) points.push_back(image.Point2D(i).Point3DId());
    if (graph == nullptr) continue;
    for (const auto& match : graph->FindCorrespondences(image_id, i)) {
      if (!model.ExistsImage(match.image_id)) continue;
      const Point2D& point2D = model.Image(match.image_id).Point2D(match.point2D_idx);
      if (point2D.HasPoint3D()) points.push_back(point2D.Point3DId());
    }
  }
  std::sort(points.begin(), points.end());
  points.erase(std::unique(points.begin(), points.end()), points.end());
  return points;
}

// Projection centres, each computed once. Threads may ask at once for those that are known.
class Centers {
 public:
  explicit Centers(const Reconstruction& model) : model_(model) {}
  const Eigen::Vector3d& Of(ImageId id) {
    const auto known = centers_.find(id);
    if (known != centers_.end()) return known->second;
    return centers_.emplace(id, model_.Image(id).ProjectionCenter()).first->second;
  }

 private:
  const Reconstruction& model_;
  std::unordered_map<ImageId, Eigen::Vector3d> centers_;
};

// A photo in which points of others are looked for.
class View {
 public:
  View(const CellGrid& grid, const CorrespondenceGraph* graph, const Reconstruction& model,
       Centers* centers, ImageId image_id, const Camera& camera, const Matrix3x4d& cam_from_world)
      : grid_(grid),
        model_(model),
        centers_(*centers),
        image_id_(image_id),
        matched_(MatchedPoints(graph, model, image_id)),
        camera_(camera),
        cam_from_world_(cam_from_world),
        center_(-cam_from_world.leftCols<3>().transpose() * cam_from_world.col(3)),
        num_keypoints_(grid.num_columns * grid.num_rows) {
    for (const Point2D& point2D : model.Image(image_id).Points2D()) {
      const int cell = CellOfPixel(point2D.XY());
      if (cell >= 0) ++num_keypoints_[cell];
    }
    SetOwnDepths();
  }

  CellVotes Compare(ImageId other_id) const {
    std::vector<Expected> expected(num_keypoints_.size());
    const Eigen::Vector3d other_center = centers_.Of(other_id);
    for (const Point2D& point2D : model_.Image(other_id).Points2D()) {
      if (!point2D.HasPoint3D()) continue;
      const Point3D& point = model_.Point3D(point2D.Point3DId());
      const Eigen::Vector3d in_camera = cam_from_world_ * point.XYZ().homogeneous();
      const int cell = CellOfPoint(in_camera);
      if (cell < 0 || !ShouldBeSeen(point, other_id, other_center)) continue;
      expected[cell].depths.push_back(in_camera.z());
      expected[cell].seen |=
          std::binary_search(matched_.begin(), matched_.end(), point2D.Point3DId());
    }
    return Count(&expected);
  }

 private:
  struct Expected {
    std::vector<double> depths;
    bool seen = false;
  };

  CellVotes Count(std::vector<Expected>* expected) const {
    CellVotes votes;
    for (size_t i = 0; i < expected->size(); ++i) {
      Expected& cell = (*expected)[i];
      const int num_expected = static_cast<int>(cell.depths.size());
      if (std::min(num_expected, num_keypoints_[i]) < kMinExpectedPoints) continue;
      ++(cell.seen ? votes.num_seen : votes.num_missing);
      if (cell.seen || own_depths_[i] <= 0) continue;
      const double ratio = UpperMedian(std::move(cell.depths)) / own_depths_[i];
      votes.num_different += ratio < kMaxDepthRatio && ratio > 1 / kMaxDepthRatio;
    }
    return votes;
  }

  // Of the photo's own points in each cell, as it stands in the model; 0 if there are too few.
  void SetOwnDepths() {
    std::vector<std::vector<double>> depths(num_keypoints_.size());
    const Matrix3x4d registered = model_.Image(image_id_).ProjectionMatrix();
    for (const Point2D& point2D : model_.Image(image_id_).Points2D()) {
      if (!point2D.HasPoint3D()) continue;
      const Eigen::Vector3d xyz = model_.Point3D(point2D.Point3DId()).XYZ();
      const int cell = CellOfPixel(point2D.XY());
      if (cell >= 0) depths[cell].push_back((registered * xyz.homogeneous()).z());
    }
    own_depths_.assign(depths.size(), 0.0);
    for (size_t i = 0; i < depths.size(); ++i) {
      const int num_points = static_cast<int>(depths[i].size());
      if (num_points >= kMinOwnPoints) own_depths_[i] = UpperMedian(std::move(depths[i]));
    }
  }

  int CellOfPixel(const Eigen::Vector2d& pixel) const {
    const double x = pixel.x() / camera_.Width(), y = pixel.y() / camera_.Height();
    if (!(x >= 0 && x < 1 && y >= 0 && y < 1)) return -1;
    return static_cast<int>(y * grid_.num_rows) * grid_.num_columns +
           static_cast<int>(x * grid_.num_columns);
  }

  int CellOfPoint(const Eigen::Vector3d& in_camera) const {
    // A wide view angle is left out: distortion models fold back there.
    if (in_camera.z() <= 0 || in_camera.head<2>().norm() > 2 * in_camera.z()) return -1;
    return CellOfPixel(camera_.WorldToImage(in_camera.hnormalized()));
  }

  bool ShouldBeSeen(const Point3D& point, ImageId other,
                    const Eigen::Vector3d& other_center) const {
    const Eigen::Vector3d ray = center_ - point.XYZ(), other_ray = other_center - point.XYZ();
    const double ratio = ray.norm() / other_ray.norm();
    if (!(ratio < kMaxDistanceRatio && ratio > 1 / kMaxDistanceRatio)) {
      return false;
    }
    const double angle = AngleBetween(ray, other_ray);
    if (angle > DegToRad(kMaxViewAngleDeg)) return false;
    for (const TrackElement& element : point.Track().Elements()) {
      if (element.image_id == image_id_ || element.image_id == other) continue;
      const Eigen::Vector3d third_ray = centers_.Of(element.image_id) - point.XYZ();
      if (AngleBetween(third_ray, other_ray) >= kAngleCover * angle) return true;
    }
    return false;
  }

  const CellGrid grid_;
  const Reconstruction& model_;
  Centers& centers_;
  const ImageId image_id_;
  const std::vector<Point3DId> matched_;
  const Camera& camera_;
  const Matrix3x4d cam_from_world_;
  const Eigen::Vector3d center_;
  std::vector<int> num_keypoints_;
  std::vector<double> own_depths_;
};

// Views of registered photos, made when they are asked for.
class Views {
 public:
  // Without a graph a photo sees the points that it observes.
  Views(const CellGrid& grid, const CorrespondenceGraph* graph, const Reconstruction& model)
      : grid_(grid), graph_(graph), model_(model), centers_(model) {}

  // As if the photo stood there.
  void Place(ImageId id, const Matrix3x4d& cam_from_world) {
    views_[id] = Make(id, cam_from_world);
  }

  const View& Of(ImageId id) {
    const auto known = views_.find(id);
    if (known != views_.end()) return *known->second;
    return *views_.emplace(id, Make(id, model_.Image(id).ProjectionMatrix())).first->second;
  }

  CellVotes CompareBothWays(ImageId id1, ImageId id2) {
    CellVotes votes = Of(id1).Compare(id2);
    votes.Add(Of(id2).Compare(id1));
    return votes;
  }

  // Whether two registered photos would not triangulate most of the points that both observe.
  bool StandTogether(ImageId id1, ImageId id2) {
    constexpr size_t kEnough = 100;
    std::vector<double> angles;
    for (const Point2D& point2D : model_.Image(id1).Points2D()) {
      if (!point2D.HasPoint3D()) continue;
      const Point3D& point = model_.Point3D(point2D.Point3DId());
      if (!point.Track().HasImage(id2)) continue;
      angles.push_back(
          AngleBetween(centers_.Of(id1) - point.XYZ(), centers_.Of(id2) - point.XYZ()));
      if (angles.size() == kEnough) break;
    }
    return angles.size() >= kMinCommonPoints &&
           UpperMedian(std::move(angles)) < DegToRad(limits::kMinTriangulationAngleDeg);
  }

  // CompareBothWays of each pair of registered photos, by several threads.
  std::vector<CellVotes> CompareAll(const std::vector<std::pair<ImageId, ImageId>>& pairs,
                                    int num_threads) {
    for (const ImageId id : model_.RegImageIds()) centers_.Of(id);
    std::vector<std::pair<ImageId, std::unique_ptr<View>*>> missing;
    for (const auto& [id1, id2] : pairs) {
      for (const ImageId id : {id1, id2}) {
        const auto [view, is_new] = views_.try_emplace(id);
        if (is_new) missing.emplace_back(id, &view->second);
      }
    }
    ForEachOnThreads(num_threads, missing.size(), [&](size_t i) {
      const auto& [id, view] = missing[i];
      *view = Make(id, model_.Image(id).ProjectionMatrix());
    });
    std::vector<CellVotes> votes(pairs.size());
    ForEachOnThreads(num_threads, pairs.size(), [&](size_t i) {
      votes[i] = CompareBothWays(pairs[i].first, pairs[i].second);
    });
    return votes;
  }

 private:
  std::unique_ptr<View> Make(ImageId id, const Matrix3x4d& cam_from_world) {
    const Camera& camera = model_.Camera(model_.Image(id).CameraId());
    return std::make_unique<View>(grid_, graph_, model_, &centers_, id, camera, cam_from_world);
  }

  const CellGrid grid_;
  const CorrespondenceGraph* const graph_;
  const Reconstruction& model_;
  Centers centers_;
  std::map<ImageId, std::unique_ptr<View>> views_;
};

// The registered photos with most matches with this one; of `among`, if that is given.
std::vector<ImageId> BestNeighbours(const SceneMap& map, ImageId image_id,
                                    const std::set<ImageId>* among = nullptr) {
  std::vector<std::pair<int, ImageId>> order;
  for (const auto& [other, inliers] : map.Neighbours(image_id)) {
    const bool is_wanted = among != nullptr ? among->count(other) > 0 : map.IsRegistered(other);
    if (is_wanted) order.emplace_back(-inliers, other);
  }
  std::sort(order.begin(), order.end());
  if (order.size() > kMaxNeighbours) order.resize(kMaxNeighbours);
  std::vector<ImageId> neighbours;
  for (const auto& [unused, other] : order) neighbours.push_back(other);
  return neighbours;
}

// Each photo with its BestNeighbours.
template <typename Ids>
std::set<std::pair<ImageId, ImageId>> PairsToCompare(const SceneMap& map, const Ids& ids,
                                                     const std::set<ImageId>* among = nullptr) {
  std::set<std::pair<ImageId, ImageId>> pairs;
  for (const ImageId id : ids) {
    for (const ImageId other : BestNeighbours(map, id, among)) {
      pairs.insert(std::minmax(id, other));
    }
  }
  return pairs;
}

double MissingShare(const CellVotes& votes) {
  return votes.num_missing / std::max<double>(1, votes.num_cells());
}

// The photos without the repetitions of a burst or a video: such a photo stands where another one
// does, and shows the same. A burst is one witness, as its photos miss the same.
// `neighbours_of`(id, witnesses): those that may repeat the photo.
template <typename Ids, typename Neighbours>
std::set<ImageId> Witnesses(const Ids& ids, const Neighbours& neighbours_of, Views* views) {
  const auto shows_the_same = [&](ImageId id1, ImageId id2) {
    const CellVotes votes = views->CompareBothWays(id1, id2);
    return votes.num_cells() >= kMinPairCells && MissingShare(votes) < kMaxDifferentShare;
  };
  std::set<ImageId> witnesses;
  for (const ImageId id : ids) {
    const std::vector<ImageId> others = neighbours_of(id, witnesses);
    const bool repeats = std::any_of(others.begin(), others.end(), [&](ImageId other) {
      return views->StandTogether(id, other) && shows_the_same(id, other);
    });
    if (!repeats) witnesses.insert(id);
  }
  return witnesses;
}

PhotoEdge EdgeByMatches(const SceneMap& map, ImageId id1, ImageId id2) {
  return {id1, id2, {map.Neighbours(id1).at(id2), 0}};
}

// At the limit, a share of all cells, as much contradicts as agrees.
Votes Weigh(double max_share, int num_seen, int num_contradicting) {
  const double weight = (1 - max_share) / max_share;
  return {num_seen, static_cast<int>(std::lround(weight * num_contradicting))};
}

bool IsAbove(double max_share, int num, const CellVotes& votes, int min_cells) {
  return votes.num_cells() >= min_cells && num > max_share * votes.num_cells();
}

// Other photos that observe points of this one, with how many.
std::map<ImageId, int> CountCommonPoints(const Reconstruction& model, ImageId image_id) {
  std::map<ImageId, int> counts;
  for (const Point2D& point2D : model.Image(image_id).Points2D()) {
    if (!point2D.HasPoint3D()) continue;
    for (const auto& element : model.Point3D(point2D.Point3DId()).Track().Elements()) {
      if (element.image_id != image_id) ++counts[element.image_id];
    }
  }
  return counts;
}

// Verified pairs of a photo of each set.
template <typename Function>
void ForEachPair(const SceneMap& map, const std::set<ImageId>& photos1,
                 const std::set<ImageId>& photos2, const Function& function) {
  for (const auto& [id1, id2] : map.pairs()) {
    const bool is_between = (photos1.count(id1) > 0 && photos2.count(id2) > 0) ||
                            (photos2.count(id1) > 0 && photos1.count(id2) > 0);
    if (is_between) function(id1, id2);
  }
}

// The 95th percentile of the pairs within the sets, at least half of kMaxMissingShare and at most
// that; that without such a pair.
double UsualMissingShare(const SceneMap& map, const std::set<ImageId>& photos1,
                         const std::set<ImageId>& photos2, Views* views) {
  std::vector<double> shares;
  for (const std::set<ImageId>* photos : {&photos1, &photos2}) {
    ForEachPair(map, *photos, *photos, [&](ImageId id1, ImageId id2) {
      const CellVotes votes = views->CompareBothWays(id1, id2);
      if (votes.num_cells() >= kMinPairCells) shares.push_back(MissingShare(votes));
    });
  }
  if (shares.empty()) return kMaxMissingShare;
  return std::clamp(percentile(shares, 95), kMaxMissingShare / 2, kMaxMissingShare);
}

// Other photos with kMinCommonPoints points of this one.
std::vector<ImageId> PhotosWithCommonPoints(const Reconstruction& model, ImageId id) {
  std::vector<ImageId> photos;
  for (const auto& [other, num_common] : CountCommonPoints(model, id)) {
    if (num_common >= kMinCommonPoints) photos.push_back(other);
  }
  return photos;
}

// Between the shared photos and the others of one model, along the tracks they have in common.
CellVotes CompareShared(const Reconstruction& model, const std::set<ImageId>& shared) {
  Views views(kSharedGrid, nullptr, model);
  std::map<ImageId, std::vector<ImageId>> neighbours;
  std::set<ImageId> others;
  for (const ImageId id : shared) {
    neighbours[id] = PhotosWithCommonPoints(model, id);
    others.insert(neighbours[id].begin(), neighbours[id].end());
  }
  for (const ImageId id : shared) others.erase(id);
  for (const ImageId id : others) neighbours[id] = PhotosWithCommonPoints(model, id);
  const auto neighbours_of = [&](ImageId id, const std::set<ImageId>& among) {
    std::vector<ImageId> wanted;
    for (const ImageId other : neighbours.at(id)) {
      if (among.count(other) > 0) wanted.push_back(other);
    }
    return wanted;
  };
  const std::set<ImageId> witnesses = Witnesses(shared, neighbours_of, &views);
  const std::set<ImageId> other_witnesses = Witnesses(others, neighbours_of, &views);
  CellVotes sum;
  for (const ImageId id : witnesses) {
    for (const ImageId other : neighbours_of(id, other_witnesses)) {
      sum.Add(views.CompareBothWays(id, other));
    }
  }
  return sum;
}

}  // namespace

void CellVotes::Add(const CellVotes& other) {
  num_seen += other.num_seen;
  num_missing += other.num_missing;
  num_different += other.num_different;
}

bool ShowsAnotherPlace(const CellVotes& votes, int min_cells) {
  return IsAbove(kMaxDifferentShare, votes.num_different, votes, min_cells);
}

bool HasTooManyMissingCells(const CellVotes& votes, int min_cells) {
  return IsAbove(kMaxMissingShare, votes.num_missing, votes, min_cells);
}

CellVotes CompareWithNeighbours(const SceneMap& map, ImageId image_id, const Camera& camera,
                                const Matrix3x4d& cam_from_world) {
  Centers centers(map.reconstruction());
  const View view(kGrid, &map.graph(), map.reconstruction(), &centers, image_id, camera,
                  cam_from_world);
  CellVotes sum;
  for (const ImageId other : BestNeighbours(map, image_id)) {
    sum.Add(view.Compare(other));
  }
  return sum;
}

CellVotes CompareWithPhoto(const SceneMap& map, ImageId image_id, const Matrix3x4d& cam_from_world,
                           ImageId other) {
  Views views(kGrid, &map.graph(), map.reconstruction());
  views.Place(image_id, cam_from_world);
  return views.Of(image_id).Compare(other);
}

std::vector<ImageId> FindPhotosOfAnotherPlace(const SceneMap& map, ImageId first, int num_threads) {
  Views views(kGrid, &map.graph(), map.reconstruction());
  const std::vector<ImageId>& ids = map.reconstruction().RegImageIds();
  const auto neighbours_of = [&](ImageId id, const std::set<ImageId>& among) {
    return BestNeighbours(map, id, &among);
  };
  const auto witnesses = Witnesses(ids, neighbours_of, &views);
  const auto to_compare = PairsToCompare(map, witnesses, &witnesses);
  const std::vector<std::pair<ImageId, ImageId>> pairs(to_compare.begin(), to_compare.end());
  const std::vector<CellVotes> votes = views.CompareAll(pairs, num_threads);
  std::vector<PhotoEdge> by_cells, by_matches;
  for (size_t i = 0; i < pairs.size(); ++i) {
    const auto& [id1, id2] = pairs[i];
    by_cells.push_back(
        {id1, id2, Weigh(kMaxDifferentShare, votes[i].num_seen, votes[i].num_different)});
  }
  for (const auto& [id1, id2] : PairsToCompare(map, ids)) {
    by_matches.push_back(EdgeByMatches(map, id1, id2));
  }
  PhotoGroups groups(ids, by_cells);
  groups.JoinByVotes(by_cells);
  groups.JoinByVotes(by_matches);  // photos that are too far apart to see the same
  const Votes limit = Weigh(kMaxDifferentShare, 0, kMinDifferentCells);
  return groups.Contradicted(limit.contradict, first);
}

std::vector<ImageId> FindPhotosOfAnotherPlaceByMissingCells(
    const SceneMap& map, ImageId first, const SimilarPlaceCandidates& candidates) {
  std::vector<ImageId> ids = map.reconstruction().RegImageIds();
  Views views(kGrid, &map.graph(), map.reconstruction());
  for (const auto& [id, cam_from_world] : candidates.waiting) {
    views.Place(id, cam_from_world);
    ids.push_back(id);
  }
  std::vector<PhotoEdge> by_cells, by_matches;
  for (const auto& [id1, id2] : PairsToCompare(map, ids)) {
    by_matches.push_back(EdgeByMatches(map, id1, id2));
    if (!candidates.Contains(id1) && !candidates.Contains(id2)) continue;
    const CellVotes cells = views.CompareBothWays(id1, id2);
    if (cells.num_cells() < kMinPairCells) continue;
    by_cells.push_back({id1, id2, Weigh(kMaxMissingShare, cells.num_seen, cells.num_missing)});
  }
  PhotoGroups groups(ids, by_cells);
  groups.JoinByVotes(by_matches);
  const Votes limit = Weigh(kMaxMissingShare, 0, kMinMissingCells);
  std::vector<ImageId> found = groups.Contradicted(limit.contradict, first);
  const auto is_waiting = [&](ImageId id) { return candidates.waiting.count(id) > 0; };
  found.erase(std::remove_if(found.begin(), found.end(), is_waiting), found.end());
  return found;
}

CellVotes ComparePair(const SceneMap& map, const Reconstruction& model, ImageId id1, ImageId id2) {
  return Views(kGrid, &map.graph(), model).CompareBothWays(id1, id2);
}

PlacesOfTwoSets ComparePlaces(const SceneMap& map, const Reconstruction& model,
                              const std::set<ImageId>& photos1, const std::set<ImageId>& photos2) {
  if (photos1.empty() || photos2.empty()) return {};
  Views views(kGrid, &map.graph(), model);
  CellVotes sum;
  int num_different = 0;
  std::vector<double> missing;  // shares of the pairs across
  ForEachPair(map, photos1, photos2, [&](ImageId id1, ImageId id2) {
    const CellVotes votes = views.CompareBothWays(id1, id2);
    sum.Add(votes);
    if (votes.num_cells() < kMinPairCells) return;
    missing.push_back(MissingShare(votes));
    num_different += ShowsAnotherPlace(votes, kMinPairCells);
  });
  if (sum.num_cells() < kMinCells) return {};
  const int num_votes = static_cast<int>(missing.size());
  const auto differ = [&](int num, const char* how) {
    return PlacesOfTwoSets{true, num_votes,
                           std::to_string(num) + " of " + std::to_string(sum.num_cells()) +
                               " cells that both show are " + how};
  };
  const auto most_miss = [&](double limit) {
    const auto num =
        std::count_if(missing.begin(), missing.end(), [&](double share) { return share > limit; });
    return 2 * num > num_votes;
  };
  if (2 * num_different > num_votes) return differ(sum.num_different, "different");
  // The pairs within cost most, and only shares between the two limits depend on them.
  if (!most_miss(kMaxMissingShare / 2)) return {false, num_votes, ""};
  if (most_miss(kMaxMissingShare) || most_miss(UsualMissingShare(map, photos1, photos2, &views))) {
    return differ(sum.num_missing, "missing");
  }
  return {false, num_votes, ""};
}

DividedPhotos DividePhotos(const SceneMap& map, const std::set<ImageId>& first,
                           const std::set<ImageId>& second, const Reconstruction& merged) {
  DividedPhotos divided;
  for (const ImageId id : merged.RegImageIds()) {
    const bool in_first = first.count(id) > 0, in_second = second.count(id) > 0;
    if (!in_first && !in_second) continue;
    int64_t more_in_first = 0;
    for (const auto& [other, num_matches] : map.Neighbours(id)) {
      if (first.count(other) > 0) more_in_first += num_matches;
      if (second.count(other) > 0) more_in_first -= num_matches;
    }
    const bool is_of_first = in_first && (!in_second || more_in_first >= 0);
    (is_of_first ? divided.of_first : divided.of_second).insert(id);
  }
  return divided;
}

Status CheckSharedPhotos(const Reconstruction& target, const Reconstruction& source,
                         const std::set<ImageId>& shared) {
  const std::pair<const char*, const Reconstruction*> models[] = {{"target", &target},
                                                                  {"source", &source}};
  for (const auto& [name, model] : models) {
    const CellVotes votes = CompareShared(*model, shared);
    if (!ShowsAnotherPlace(votes)) continue;
    return FailedPrecondition("visually similar places: " + std::to_string(votes.num_different) +
                              " of " + std::to_string(votes.num_cells()) +
                              " cells that shared photos and the " + name +
                              "'s own show are different");
  }
  return Status::Ok();
}

}  // namespace skein
