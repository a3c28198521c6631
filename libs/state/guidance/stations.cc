#include "guidance/stations.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <utility>

#include "guidance/depth_grid.h"
#include "guidance/free_space.h"
#include "guidance/surfel_blocks.h"
#include "guidance/surfel_views.h"
#include "guidance/weak_places.h"

namespace skein {
namespace {

// Share of the map's points in view that are matched, if they were seen before from a direction
// less than 30 degrees away.
constexpr double kMatchRate = 0.3;
// A viewpoint this many working distances from where the agent is counts half.
constexpr double kHalfDistance = 3;
constexpr size_t kMaxCandidates = 2000;  // that are looked at for an agent
constexpr double kMoreIsKnown = 2;       // times as many common points: a failed photo may succeed

// As a person holds a camera. `right`: of the photo where it looks straight up or down.
CameraPose LookAt(const Eigen::Vector3d& centre, const Eigen::Vector3d& target,
                  const Eigen::Vector3d& up, const Eigen::Vector3d& right) {
  constexpr double kMaxCos = 0.95;
  const Eigen::Vector3d z = (target - centre).normalized();
  Eigen::Vector3d x = std::abs(z.dot(up)) > kMaxCos ? Eigen::Vector3d(right - right.dot(z) * z)
                                                    : Eigen::Vector3d(z.cross(up));
  if (x.norm() < 1e-6) x = z.unitOrthogonal();
  x.normalize();
  Eigen::Matrix3d rotation;
  rotation << x.transpose(), z.cross(x).transpose(), z.transpose();
  CameraPose pose;
  pose.rotation = Eigen::Quaterniond(rotation).normalized();
  pose.translation = -(pose.rotation * centre);
  return pose;
}

// Even-odd rule, seen along `up`.
bool IsInside(const std::vector<Eigen::Vector3d>& polygon, const Eigen::Vector3d& up,
              const Eigen::Vector3d& position) {
  const Eigen::Vector3d x_axis = up.unitOrthogonal(), y_axis = up.cross(x_axis);
  const double x = position.dot(x_axis), y = position.dot(y_axis);
  bool inside = false;
  for (size_t i = 0, j = polygon.size() - 1; i < polygon.size(); j = i++) {
    const double xi = polygon[i].dot(x_axis), yi = polygon[i].dot(y_axis);
    const double xj = polygon[j].dot(x_axis), yj = polygon[j].dot(y_axis);
    if ((yi > y) != (yj > y) && x < (xj - xi) * (y - yi) / (yj - yi) + xi) inside = !inside;
  }
  return inside;
}

// To the nearest surfel, or `max` where none is nearer.
double DistanceTo(const SurfelBlocks& blocks, const Eigen::Vector3d& position, double max) {
  double least = max;
  for (const SurfelBlocks::Block& block : blocks.blocks()) {
    if ((block.middle - position).norm() > least + block.radius) continue;
    for (const Eigen::Vector3f& surfel : block.positions) {
      least = std::min(least, (surfel.cast<double>() - position).norm());
    }
  }
  return least;
}

// Chooses for one map; weak places become better as viewpoints are chosen.
class Chooser {
 public:
  Chooser(double min_common_points, const GuidedMap& map, const PlaceQuality& place)
      : min_common_points_(min_common_points),
        target_gsd_(place.completeness.target_gsd),
        map_(map),
        place_(place),
        weak_(FindWeak(place)) {
    up_ = UpOf(map);
    blocks_ = BlocksOf(place.surface);
    weak_blocks_ = SurfelBlocks(place.surface.cell);
    for (uint32_t i = 0; i < weak_.size(); ++i) {
      weak_blocks_.Add(i, weak_[i].position.cast<float>());
    }
    for (const GuidedPhoto& photo : map.photos) centres_.push_back(photo.cam_from_world.Centre());
  }

  // False: nothing is left to gain within reach.
  bool ChooseNext(const StationSeeker& seeker, std::vector<Station>* stations);

 private:
  struct Ground {
    Eigen::Vector3d up;
    double min_height, max_height;
  };
  // What a camera sees of the surface.
  struct View {
    DepthGrid grid;
    std::vector<DepthGrid::InFrame> in_frame;  // surfels
  };
  // A weak place that a photo from somewhere would show, and the gain if its views are those of
  // that version.
  struct Shown {
    uint32_t weak;
    double gain;
    uint64_t version;
  };
  // A place to take a photo from.
  struct Stand {
    bool is_possible = false;
    double common_points = 0;
    std::vector<Shown> shown;
  };
  // A pose that may become a viewpoint.
  struct Candidate {
    CameraPose pose;
    Eigen::Vector3d centre;
    Eigen::Vector3d target;
    size_t example;  // weakest of what it aims at
    double hope;     // score if nothing hides it, for the order in which candidates are looked at
  };
  struct Found {
    Station station;                  // without its reason
    size_t example;                   // as the candidate's
    const std::vector<Shown>* shown;  // of its stand
  };

  Ground GroundOf(const StationSeeker& seeker) const;
  std::vector<Candidate> MakeCandidates(const StationSeeker& seeker, const Ground& ground);
  const std::vector<Cluster>& ClustersOfWidth(double width);
  bool IsBetween(const std::vector<const SurfelBlocks::Block*>& blocks, const Eigen::Vector3d& from,
                 const Eigen::Vector3d& to) const;
  double ClearanceOf(int32_t agent);
  bool MayStandAt(const StationSeeker& seeker, const Ground& ground, const Eigen::Vector3d& centre);
  bool WasInVain(const StationSeeker& seeker, const CameraPose& pose, double common_points) const;
  std::vector<std::pair<uint32_t, Weak>> TakeInVain(const StationSeeker& seeker);
  double Nearness(const StationSeeker& seeker, const Eigen::Vector3d& centre) const;
  double GainOf(const Eigen::Vector3d& centre, double focal_px, Weak* weak) const;
  double HopeOf(const WeakCluster& cluster, const Eigen::Vector3d& centre, double focal_px);
  std::vector<Shown> ShownIn(const View& view, const Eigen::Vector3d& centre) const;
  double GainOf(const Eigen::Vector3d& centre, double focal_px, std::vector<Shown>* shown);
  void FillViews(Weak* weak) const;
  double UtilityWith(const ViewOfSurfel& view, Weak* weak) const;
  double CountCommon(const StationSeeker& seeker, const View& view, const Eigen::Vector3d& centre);
  void Take(const std::vector<Shown>& shown, const Eigen::Vector3d& centre, double focal_px);
  Station::Why WhyOf(Weak* weak_place) const;
  uint32_t NearestPhoto(const Candidate& candidate) const;
  const GuidedCamera& CameraOf(const StationSeeker& seeker) const {
    return map_.cameras[map_.photos[seeker.last_photo].camera];
  }
  Stand* StandAt(const StationSeeker& seeker, const Ground& ground, const Candidate& candidate);
  std::optional<Found> FindBest(const StationSeeker& seeker, const Ground& ground,
                                const std::vector<Candidate>& candidates);
  View ViewFromPose(const StationSeeker& seeker, const CameraPose& pose) const {
    View view{
        DepthGrid(CameraOf(seeker), pose, place_.surface.cell, place_.surface.working_distance),
        {}};
    view.in_frame = view.grid.Draw(blocks_);
    return view;
  }

  const double min_common_points_;
  const double target_gsd_;
  const GuidedMap& map_;
  const PlaceQuality& place_;
  std::vector<Weak> weak_;
  std::vector<Eigen::Vector3d> centres_;
  SurfelBlocks blocks_;                              // the surfels
  SurfelBlocks weak_blocks_;                         // the weak places
  std::map<double, std::vector<Cluster>> clusters_;  // of the weak places, by width
  std::map<int32_t, double> clearances_;             // of agents' viewpoints from surfaces
  // By the agent, and where it would stand and look: most candidates come again for each viewpoint.
  std::map<std::array<double, 7>, Stand> stands_;
  std::optional<FreeSpace> free_space_;  // once it is asked for
  uint64_t last_version_ = 0;
  Eigen::Vector3d up_;
};

Chooser::Ground Chooser::GroundOf(const StationSeeker& seeker) const {
  Ground ground{seeker.reach.up.isZero() ? up_ : seeker.reach.up, seeker.reach.min_height,
                seeker.reach.max_height};
  if (ground.min_height <= ground.max_height) return ground;
  ground.min_height = std::numeric_limits<double>::infinity();
  ground.max_height = -ground.min_height;
  for (size_t i = 0; i < centres_.size(); ++i) {
    if (map_.photos[i].agent != seeker.agent) continue;
    ground.min_height = std::min(ground.min_height, centres_[i].dot(ground.up));
    ground.max_height = std::max(ground.max_height, centres_[i].dot(ground.up));
  }
  return ground;
}

const std::vector<Cluster>& Chooser::ClustersOfWidth(double width) {
  const auto [found, is_new] = clusters_.try_emplace(width);
  if (is_new) found->second = ClusterWeak(weak_, width);
  return found->second;
}

// Straight in front of each weak place and around it, so that parallax comes with any photo that is
// there.
std::vector<Chooser::Candidate> Chooser::MakeCandidates(const StationSeeker& seeker,
                                                        const Ground& ground) {
  constexpr int kDirections = 8, kMaxClusters = 120;
  constexpr double kTiltsDeg[] = {0, 20, 40};
  const Surface& surface = place_.surface;
  const double focal_px = CameraOf(seeker).FocalPx();
  const double distance = std::min(surface.working_distance, 0.9 * target_gsd_ * focal_px);
  const Eigen::Vector3d right = RightOf(map_.photos[seeker.last_photo].cam_from_world);
  std::vector<Candidate> candidates;
  for (const WeakCluster& weak :
       FindWeakest(weak_, ClustersOfWidth(0.4 * distance), kMaxClusters)) {
    const Cluster& cluster = *weak.cluster;
    const Eigen::Vector3d side = cluster.normal.unitOrthogonal();
    for (const double tilt_deg : kTiltsDeg) {
      for (int i = 0; i < (tilt_deg == 0 ? 1 : kDirections); ++i) {
        const Eigen::Vector3d axis =
            Eigen::AngleAxisd(i * 360 * kRadian / kDirections, cluster.normal) * side;
        const Eigen::Vector3d ray = Eigen::AngleAxisd(tilt_deg * kRadian, axis) * cluster.normal;
        Eigen::Vector3d centre = cluster.position + distance * ray;
        const double height = centre.dot(ground.up);
        centre += (std::clamp(height, ground.min_height, ground.max_height) - height) * ground.up;
        if ((centre - cluster.position).norm() > 2 * distance) continue;
        const double hope = HopeOf(weak, centre, focal_px) * Nearness(seeker, centre);
        if (hope <= 0) continue;
        candidates.push_back({LookAt(centre, cluster.position, ground.up, right), centre,
                              cluster.position, weak.weakest.front(), hope});
      }
    }
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.hope > b.hope; });
  if (candidates.size() > kMaxCandidates) candidates.resize(kMaxCandidates);
  return candidates;
}

// Whether a surfel lies close to the straight line between the two.
bool Chooser::IsBetween(const std::vector<const SurfelBlocks::Block*>& blocks,
                        const Eigen::Vector3d& from, const Eigen::Vector3d& to) const {
  const Eigen::Vector3d way = to - from;
  const double length = way.norm(), width = place_.surface.cell;
  const Eigen::Vector3d direction = way / std::max(length, 1e-12);
  const auto is_close = [&](const Eigen::Vector3d& surfel) {
    const Eigen::Vector3d offset = surfel - from;
    const double along = offset.dot(direction);
    if (along <= 0 || along >= length) return false;
    return (offset - along * direction).squaredNorm() < width * width;
  };
  return std::any_of(blocks.begin(), blocks.end(), [&](const SurfelBlocks::Block* block) {
    const Eigen::Vector3d offset = block->middle - from;
    const double along = std::clamp(offset.dot(direction), 0.0, length);
    if ((offset - along * direction).norm() > width + block->radius) return false;
    return std::any_of(block->positions.begin(), block->positions.end(),
                       [&](const Eigen::Vector3f& p) { return is_close(p.cast<double>()); });
  });
}

// As close to a surface as nine of ten of the agent's photos were taken, but at most a quarter of
// the working distance: among furniture that much is nowhere free.
double Chooser::ClearanceOf(int32_t agent) {
  const double most = 0.25 * place_.surface.working_distance;
  const auto [clearance, is_new] = clearances_.try_emplace(agent, most);
  if (!is_new) return clearance->second;
  std::vector<double> distances;
  for (size_t i = 0; i < centres_.size(); ++i) {
    if (map_.photos[i].agent != agent) continue;
    distances.push_back(DistanceTo(blocks_, centres_[i], most));
  }
  if (distances.empty()) return most;
  const auto tenth = distances.begin() + static_cast<ptrdiff_t>(distances.size() / 10);
  std::nth_element(distances.begin(), tenth, distances.end());
  return clearance->second = *tenth;
}

// No closer to a surface than the agent has been, and within the reach of some photo, whose view of
// it is free.
bool Chooser::MayStandAt(const StationSeeker& seeker, const Ground& ground,
                         const Eigen::Vector3d& centre) {
  const double clearance = ClearanceOf(seeker.agent);
  if (DistanceTo(blocks_, centre, clearance) < clearance) return false;
  for (const auto& polygon : seeker.reach.no_go) {
    if (IsInside(polygon, ground.up, centre)) return false;
  }
  const double step = 1.5 * place_.surface.working_distance;
  const double near = step + place_.surface.cell;
  std::vector<const SurfelBlocks::Block*> blocks;  // whose surfels may be between
  for (const SurfelBlocks::Block& block : blocks_.blocks()) {
    if ((block.middle - centre).norm() <= near + block.radius) blocks.push_back(&block);
  }
  return std::any_of(centres_.begin(), centres_.end(), [&](const Eigen::Vector3d& from) {
    return (centre - from).norm() <= step && !IsBetween(blocks, from, centre);
  });
}

Chooser::Stand* Chooser::StandAt(const StationSeeker& seeker, const Ground& ground,
                                 const Candidate& candidate) {
  const Eigen::Vector3d &at = candidate.centre, &to = candidate.target;
  const auto [found, is_new] = stands_.try_emplace(
      {static_cast<double>(seeker.agent), at.x(), at.y(), at.z(), to.x(), to.y(), to.z()});
  Stand& stand = found->second;
  if (!is_new) return &stand;
  stand.is_possible = MayStandAt(seeker, ground, candidate.centre);
  if (!stand.is_possible) return &stand;
  const View view = ViewFromPose(seeker, candidate.pose);
  stand.common_points = CountCommon(seeker, view, candidate.centre);
  if (stand.common_points >= min_common_points_) {
    stand.shown = ShownIn(view, candidate.centre);
  }
  return &stand;
}

// Nobody stands more exactly where it was told to. A failed photo may succeed with a map that has
// grown there.
bool Chooser::WasInVain(const StationSeeker& seeker, const CameraPose& pose,
                        double common_points) const {
  constexpr double kSame = 0.2;
  return std::any_of(seeker.in_vain.begin(), seeker.in_vain.end(), [&](const VainPhoto& photo) {
    return HowFar(photo.cam_from_world, pose, place_.surface.working_distance) < kSame &&
           common_points < kMoreIsKnown * photo.common_points;
  });
}

// As if failed photos had been taken, so that advice goes to other places: what hides one from a
// viewpoint hides it from those beside it, too. Returns what was weak before, of what changed.
std::vector<std::pair<uint32_t, Weak>> Chooser::TakeInVain(const StationSeeker& seeker) {
  std::vector<std::pair<uint32_t, Weak>> before;
  for (const VainPhoto& photo : seeker.in_vain) {
    const View view = ViewFromPose(seeker, photo.cam_from_world);
    const Eigen::Vector3d centre = photo.cam_from_world.Centre();
    if (CountCommon(seeker, view, centre) >= kMoreIsKnown * photo.common_points) continue;
    const std::vector<Shown> shown = ShownIn(view, centre);
    for (const Shown& one : shown) before.emplace_back(one.weak, weak_[one.weak]);
    Take(shown, centre, CameraOf(seeker).FocalPx());
  }
  return before;
}

double Chooser::Nearness(const StationSeeker& seeker, const Eigen::Vector3d& centre) const {
  const double half = kHalfDistance * place_.surface.working_distance;
  return half / (half + (centre - centres_[seeker.last_photo]).norm());
}

std::vector<Chooser::Shown> Chooser::ShownIn(const View& view,
                                             const Eigen::Vector3d& centre) const {
  constexpr uint64_t kNone = std::numeric_limits<uint64_t>::max();
  std::vector<Shown> shown;
  for (const SurfelBlocks::Block& block : weak_blocks_.blocks()) {
    if (!view.grid.MayMeet(block.middle, block.radius)) continue;
    for (const uint32_t i : block.surfels) {
      if (!Shows(centre, weak_[i])) continue;
      // What may lie around a corner is not seen through the corner.
      const double tolerance = weak_[i].is_beyond ? 0 : kDepthTolerance;
      if (view.grid.Look(weak_[i].position, tolerance) != DepthGrid::Sight::kSeen) continue;
      shown.push_back({i, 0, kNone});
    }
  }
  return shown;
}

void Chooser::FillViews(Weak* weak) const {
  if (weak->is_beyond || weak->assessed != nullptr) return;
  weak->views = ViewsOf(map_, *weak->surfel);
  weak->assessed = std::make_shared<AssessedViews>(target_gsd_, weak->normal, weak->views);
}

double Chooser::UtilityWith(const ViewOfSurfel& view, Weak* weak) const {
  if (weak->is_beyond) return UtilityOfBorder(weak->views.size() + 1);
  FillViews(weak);
  return UtilityOf(target_gsd_, weak->assessed->QualityWith(view));
}

double Chooser::GainOf(const Eigen::Vector3d& centre, double focal_px, Weak* weak) const {
  const ViewOfSurfel view = ViewFrom(centre, focal_px, weak->position);
  return weak->area * std::max(0.0, UtilityWith(view, weak) - weak->utility);
}

// Of the cluster's area, as its weakest members would gain in full view. Some places gain by no
// photo from where one can stand, as the sides of a window's recess.
double Chooser::HopeOf(const WeakCluster& cluster, const Eigen::Vector3d& centre, double focal_px) {
  double missing = 0, gain = 0;
  for (const uint32_t i : cluster.weakest) {
    missing += Missing(weak_[i]);
    if (Shows(centre, weak_[i])) gain += GainOf(centre, focal_px, &weak_[i]);
  }
  return gain / missing * cluster.missing;
}

double Chooser::GainOf(const Eigen::Vector3d& centre, double focal_px, std::vector<Shown>* shown) {
  double gain = 0;
  for (Shown& one : *shown) {
    Weak& weak = weak_[one.weak];
    if (weak.utility >= 1) continue;
    if (one.version != weak.version) {
      one.gain = GainOf(centre, focal_px, &weak);
      one.version = weak.version;
    }
    gain += one.gain;
  }
  return gain;
}

// Predicted, with the map. Points look alike from directions less than 30 degrees apart, at up to
// twice the size. Space that no photo has looked through is mostly free outdoors, but something may
// stand in it, as among furniture: an agent with failed photos counts on points through known space
// alone.
double Chooser::CountCommon(const StationSeeker& seeker, const View& view,
                            const Eigen::Vector3d& centre) {
  constexpr double kMinCos = 0.8660254037844387, kMaxRatio = 2;
  const bool is_wary = !seeker.in_vain.empty();
  if (is_wary && !free_space_) {
    free_space_.emplace(map_, place_.surface.cell, 3 * place_.surface.working_distance);
  }
  int64_t num_points = 0;
  for (const DepthGrid::InFrame& in_frame : view.in_frame) {
    if (!view.grid.IsSeen(in_frame, kDepthTolerance)) continue;
    const Surfel& surfel = place_.surface.surfels[in_frame.index];
    const Eigen::Vector3d ray = centre - surfel.position;
    const double distance = ray.norm();
    if (ray.dot(surfel.normal) <= 0) continue;
    // The newest are more often near.
    const bool known =
        std::any_of(surfel.photos.rbegin(), surfel.photos.rend(), [&](uint32_t photo) {
          const Eigen::Vector3d other = centres_[photo] - surfel.position;
          const double other_distance = other.norm();
          return ray.dot(other) >= kMinCos * distance * other_distance &&
                 other_distance < kMaxRatio * distance && distance < kMaxRatio * other_distance;
        });
    if (!known) continue;
    if (is_wary && !free_space_->IsClear(centre, surfel.position)) continue;
    num_points += surfel.num_points;
  }
  return kMatchRate * static_cast<double>(num_points);
}

void Chooser::Take(const std::vector<Shown>& shown, const Eigen::Vector3d& centre,
                   double focal_px) {
  ++last_version_;
  for (const Shown& one : shown) {
    Weak& weak = weak_[one.weak];
    FillViews(&weak);
    weak.views.push_back(ViewFrom(centre, focal_px, weak.position));
    if (weak.is_beyond) {
      weak.utility = UtilityOfBorder(weak.views.size());
    } else {
      weak.assessed = std::make_shared<AssessedViews>(target_gsd_, weak.normal, weak.views);
      weak.utility = UtilityOf(target_gsd_, weak.assessed->Quality());
    }
    weak.version = last_version_;
  }
}

Station::Why Chooser::WhyOf(Weak* weak_place) const {
  FillViews(weak_place);
  const Weak& weak = *weak_place;
  if (weak.is_beyond) return Station::Why::kOpenBorder;
  if (weak.views.size() < kMinSurfelPhotos) return Station::Why::kFewPhotos;
  std::vector<ViewOfSurfel> fine, straight;
  for (const ViewOfSurfel& view : weak.views) {
    if (view.gsd > target_gsd_) continue;
    fine.push_back(view);
    if (view.direction.dot(weak.normal) >= kMinCosIncidence) straight.push_back(view);
  }
  if (fine.size() < kMinSurfelPhotos) return Station::Why::kTooFar;
  if (straight.size() < kMinSurfelPhotos) return Station::Why::kTooSlanted;
  return Station::Why::kNoParallax;
}

uint32_t Chooser::NearestPhoto(const Candidate& candidate) const {
  uint32_t nearest = 0;
  double least = std::numeric_limits<double>::infinity();
  for (uint32_t i = 0; i < centres_.size(); ++i) {
    const double away =
        HowFar(map_.photos[i].cam_from_world, candidate.pose, place_.surface.working_distance);
    if (away < least) {
      least = away;
      nearest = i;
    }
  }
  return nearest;
}

// Candidates are looked at in the order of what they hope for. As a photo gains most where it aims,
// the best one is among the first; each view that is tried costs the number of surfels.
std::optional<Chooser::Found> Chooser::FindBest(const StationSeeker& seeker, const Ground& ground,
                                                const std::vector<Candidate>& candidates) {
  constexpr int kTried = 60;  // that may be stood at
  const double focal_px = CameraOf(seeker).FocalPx();
  const Candidate* best = nullptr;
  Found found;
  double best_score = 0;
  int num_tried = 0;
  for (const Candidate& candidate : candidates) {
    if (num_tried >= kTried) break;
    Stand* stand = StandAt(seeker, ground, candidate);
    if (!stand->is_possible) continue;
    ++num_tried;
    if (stand->common_points < min_common_points_) continue;
    if (WasInVain(seeker, candidate.pose, stand->common_points)) continue;
    const double gain = GainOf(candidate.centre, focal_px, &stand->shown);
    const double score = gain * Nearness(seeker, candidate.centre);
    if (score <= best_score) continue;
    best_score = score;
    best = &candidate;
    found.shown = &stand->shown;
    found.station.gain = gain;
    found.station.common_points = stand->common_points;
  }
  // A photo that makes less than half a cell better is not worth a walk.
  const double least = 0.5 * place_.surface.cell * place_.surface.cell;
  if (best == nullptr || found.station.gain < least) return std::nullopt;
  found.station.cam_from_world = best->pose;
  found.station.target = best->target;
  found.example = best->example;
  found.station.nearest_photo = NearestPhoto(*best);
  return found;
}

bool Chooser::ChooseNext(const StationSeeker& seeker, std::vector<Station>* stations) {
  const std::vector<std::pair<uint32_t, Weak>> before = TakeInVain(seeker);
  const Ground ground = GroundOf(seeker);
  std::optional<Found> found = FindBest(seeker, ground, MakeCandidates(seeker, ground));
  for (auto changed = before.rbegin(); changed != before.rend(); ++changed) {
    weak_[changed->first] = changed->second;
  }
  if (!found) return false;
  found->station.why = WhyOf(&weak_[found->example]);
  stations->push_back(found->station);
  Take(*found->shown, found->station.cam_from_world.Centre(), CameraOf(seeker).FocalPx());
  return true;
}

}  // namespace

std::vector<std::vector<Station>> ChooseStations(const GuidedMap& map, const PlaceQuality& place,
                                                 const std::vector<StationSeeker>& seekers,
                                                 double min_common_points) {
  std::vector<std::vector<Station>> stations(seekers.size());
  if (place.surface.surfels.empty()) return stations;
  Chooser chooser(min_common_points, map, place);
  std::vector<bool> done(seekers.size(), false);
  for (int round = 0; round < kMaxStations; ++round) {
    for (size_t i = 0; i < seekers.size(); ++i) {
      if (!done[i]) done[i] = !chooser.ChooseNext(seekers[i], &stations[i]);
    }
  }
  return stations;
}

}  // namespace skein
