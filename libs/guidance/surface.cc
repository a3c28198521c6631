#include "guidance/surface.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "core/option_check.h"
#include "guidance/cells.h"
#include "guidance/depth_grid.h"

namespace skein {
namespace {

double Median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// With fewer points in and around a cell nothing can be said of its surface: these are more often
// wrong than not.
constexpr size_t kMinPointsOfNormal = 6;

// Of a part's cell: then a plane has nine points in and around it, and kMinPointsOfNormal are there
// in 88 % of the cells where points lie at random (Poisson).
constexpr double kPointsPerPart = 1;
// A window of dense matching tells nothing of what is smaller than itself (7 x 7 pixels in
// benchmark/plane_sweep.h; 5 x 5 to 11 x 11 are usual).
constexpr double kMinPartPx = 7;

// Lengths that everything else is measured by.
struct Scale {
  double median_gsd = 0;        // of a point in its nearest photo
  double observed_gsd = 0;      // of an observation
  double working_distance = 0;  // of an observation
  double points_per_photo = 0;
};

std::vector<Eigen::Vector3d> CentresOf(const GuidedMap& map) {
  std::vector<Eigen::Vector3d> centres;
  for (const GuidedPhoto& photo : map.photos) centres.push_back(photo.cam_from_world.Centre());
  return centres;
}

Scale MeasureScale(const GuidedMap& map, const std::vector<Eigen::Vector3d>& centres) {
  std::vector<double> nearest, observed, distances, counts(map.photos.size(), 0.0);
  for (const GuidedPoint& point : map.points) {
    double best = std::numeric_limits<double>::infinity();
    for (const uint32_t photo : point.photos) {
      const double distance = (point.xyz - centres[photo]).norm();
      const double gsd = distance / map.cameras[map.photos[photo].camera].FocalPx();
      best = std::min(best, gsd);
      observed.push_back(gsd);
      distances.push_back(distance);
      ++counts[photo];
    }
    if (!point.photos.empty()) nearest.push_back(best);
  }
  return {Median(std::move(nearest)), Median(std::move(observed)), Median(std::move(distances)),
          Median(std::move(counts))};
}

double CellWidth(const SurfaceOptions& options, const GuidedMap& map, const Scale& scale) {
  std::vector<double> widths, areas;
  for (const GuidedPhoto& photo : map.photos) {
    const GuidedCamera& camera = map.cameras[photo.camera];
    widths.push_back(camera.width_px);
    areas.push_back(static_cast<double>(camera.width_px) * camera.height_px);
  }
  const double wanted_px = std::sqrt(Median(std::move(areas)) * options.points_per_cell /
                                     std::max(1.0, scale.points_per_photo));
  const double max_px =
      std::max(options.min_cell_px, options.max_cell_share * Median(std::move(widths)));
  return std::clamp(wanted_px, options.min_cell_px, max_px) * scale.observed_gsd;
}

// The surfels of a surface by the cell that they lie in; of several in one, the first.
class SurfelCells {
 public:
  explicit SurfelCells(const Surface& surface) : cells_(surface.cell) {
    for (uint32_t i = 0; i < surface.surfels.size(); ++i) {
      const auto cell = cells_.CellOf(surface.surfels[i].position);
      if (cell && cells_.Occupy(*cell) == surfel_of_.size()) surfel_of_.push_back(i);
    }
  }

  std::optional<uint32_t> Find(const Eigen::Vector3d& xyz) const {
    const auto cell = cells_.CellOf(xyz);
    const uint32_t* index = cell ? cells_.Find(*cell) : nullptr;
    return index == nullptr ? std::nullopt : std::optional(surfel_of_[*index]);
  }

  // As Cells::VisitAround, of a place.
  template <typename Visit>
  void VisitAround(const Eigen::Vector3d& xyz, int radius, const Visit& visit) const {
    const auto cell = cells_.CellOf(xyz);
    if (cell) cells_.VisitAround(*cell, radius, [&](uint32_t i) { visit(surfel_of_[i]); });
  }

 private:
  Cells cells_;
  std::vector<uint32_t> surfel_of_;
};

// The points of a map by the cell that they lie in.
struct PointCells {
  explicit PointCells(double width) : cells(width) {}

  Cells cells;
  std::vector<Cells::Cell> cell_of;            // by index
  std::vector<std::vector<uint32_t>> members;  // by index: points
};

PointCells PutIntoCells(const GuidedMap& map, double width) {
  PointCells result(width);
  for (size_t i = 0; i < map.points.size(); ++i) {
    const auto cell = result.cells.CellOf(map.points[i].xyz);
    if (!cell) continue;
    const uint32_t index = result.cells.Occupy(*cell);
    if (index == result.members.size()) {
      result.cell_of.push_back(*cell);
      result.members.emplace_back();
    }
    result.members[index].push_back(static_cast<uint32_t>(i));
  }
  return result;
}

// Photos that observe one of the points, ascending. Keeps a mark a photo from call to call.
class Observers {
 public:
  explicit Observers(const GuidedMap& map) : map_(map), marks_(map.photos.size(), 0) {}

  std::vector<uint32_t> Of(const std::vector<uint32_t>& points) {
    ++mark_;
    std::vector<uint32_t> photos;
    for (const uint32_t point : points) {
      for (const uint32_t photo : map_.points[point].photos) {
        if (std::exchange(marks_[photo], mark_) != mark_) photos.push_back(photo);
      }
    }
    std::sort(photos.begin(), photos.end());
    return photos;
  }

 private:
  const GuidedMap& map_;
  std::vector<uint32_t> marks_;
  uint32_t mark_ = 0;
};

// Sums of points, less a common origin near them: of cells together they are added.
struct Moments {
  size_t count = 0;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();

  void Add(const Eigen::Vector3d& offset) {
    ++count;
    sum += offset;
    squares += offset * offset.transpose();
  }
  void Add(const Moments& other) {
    count += other.count;
    sum += other.sum;
    squares += other.squares;
  }
};

std::vector<Moments> MomentsOf(const GuidedMap& map, const PointCells& points) {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  for (const GuidedPoint& point : map.points) origin += point.xyz;
  origin /= static_cast<double>(std::max<size_t>(1, map.points.size()));
  std::vector<Moments> moments(points.members.size());
  for (size_t index = 0; index < moments.size(); ++index) {
    for (const uint32_t point : points.members[index]) {
      moments[index].Add(map.points[point].xyz - origin);
    }
  }
  return moments;
}

// Least-squares plane of the points in and around a cell, towards where they were seen from; that
// direction itself where the points are no surface.
Eigen::Vector3d NormalOf(const Moments& around, const Eigen::Vector3d& towards) {
  constexpr double kMaxThickness = 0.5;  // standard deviation across, over that along
  const Eigen::Matrix3d scatter =
      around.squares - around.sum * around.sum.transpose() / static_cast<double>(around.count);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(scatter);
  const Eigen::Vector3d& values = solver.eigenvalues();
  if (values[0] > kMaxThickness * kMaxThickness * values[1]) return towards;
  const Eigen::Vector3d normal = solver.eigenvectors().col(0);
  return normal.dot(towards) < 0 ? Eigen::Vector3d(-normal) : normal;
}

// A plane across cubes meets |nx| + |ny| + |nz| of them for each face's area.
double AreaOf(double width, const Eigen::Vector3d& normal) {
  return width * width / normal.lpNorm<1>();
}

Surfel MakeSurfel(const GuidedMap& map, const std::vector<Eigen::Vector3d>& centres,
                  const PointCells& points, uint32_t index, const Moments& around,
                  Observers* observers) {
  const std::vector<uint32_t>& members = points.members[index];
  Surfel surfel;
  for (const uint32_t point : members) surfel.position += map.points[point].xyz;
  surfel.position /= static_cast<double>(members.size());
  surfel.num_points = static_cast<uint32_t>(members.size());
  surfel.photos = observers->Of(members);
  Eigen::Vector3d towards = Eigen::Vector3d::Zero();
  for (const uint32_t photo : surfel.photos) {
    towards += (centres[photo] - surfel.position).normalized();
  }
  if (towards.norm() < 1e-9) towards = Eigen::Vector3d::UnitZ();
  surfel.normal = NormalOf(around, towards.normalized());
  surfel.area = AreaOf(points.cells.width(), surfel.normal);
  surfel.beyond = surfel.position;
  surfel.beyond_normal = surfel.normal;
  return surfel;
}

std::vector<Surfel> MakeSurfels(const GuidedMap& map, const std::vector<Eigen::Vector3d>& centres,
                                const PointCells& points) {
  std::vector<Surfel> surfels;
  Observers observers(map);
  const std::vector<Moments> moments = MomentsOf(map, points);
  for (uint32_t index = 0; index < points.members.size(); ++index) {
    Moments around;
    points.cells.VisitAround(points.cell_of[index], 1,
                             [&](uint32_t other) { around.Add(moments[other]); });
    if (around.count >= kMinPointsOfNormal) {
      surfels.push_back(MakeSurfel(map, centres, points, index, around, &observers));
    }
  }
  return surfels;
}

bool LooksAt(const Eigen::Vector3d& centre, const Surfel& surfel, double min_cos) {
  const Eigen::Vector3d ray = centre - surfel.position;
  return ray.dot(surfel.normal) >= min_cos * ray.norm();
}

// What photos have in view, with nothing in front and from any side.
struct Sights {
  std::vector<DepthGrid> grids;               // of each photo, with the surfels drawn
  std::vector<std::vector<uint32_t>> photos;  // of each surfel, ascending
};

Sights FindSights(const SurfaceOptions& options, const GuidedMap& map, const Surface& surface) {
  const Eigen::Matrix3Xf positions = PositionsOf(surface.surfels);
  Sights sights;
  sights.photos.resize(surface.surfels.size());
  for (uint32_t photo = 0; photo < map.photos.size(); ++photo) {
    sights.grids.emplace_back(map.cameras[map.photos[photo].camera],
                              map.photos[photo].cam_from_world, surface.cell,
                              surface.working_distance);
    DepthGrid& grid = sights.grids.back();
    for (const DepthGrid::InFrame& surfel : grid.Draw(positions)) {
      if (grid.IsSeen(surfel, options.depth_tolerance)) {
        sights.photos[surfel.index].push_back(photo);
      }
    }
  }
  return sights;
}

// Those of `photos` for which `sees` holds, beside those that observe the surfel.
template <typename Sees>
void AddPhotos(const std::vector<uint32_t>& photos, const Sees& sees, Surfel* surfel) {
  std::vector<uint32_t> all;
  all.reserve(surfel->photos.size() + photos.size());
  auto observer = surfel->photos.begin();
  for (const uint32_t photo : photos) {
    while (observer != surfel->photos.end() && *observer < photo) all.push_back(*observer++);
    if (observer != surfel->photos.end() && *observer == photo) continue;
    if (sees(photo)) all.push_back(photo);
  }
  all.insert(all.end(), observer, surfel->photos.end());
  surfel->photos = std::move(all);
}

// Directions in the surfel's plane, as angles, of those around it.
std::vector<double> AnglesAround(const Surfel& surfel, const std::vector<Surfel>& around,
                                 const Eigen::Vector3d& x_axis, const Eigen::Vector3d& y_axis) {
  std::vector<double> angles;
  for (const Surfel& other : around) {
    const Eigen::Vector3d offset = other.position - surfel.position;
    const double x = offset.dot(x_axis), y = offset.dot(y_axis);
    if (std::hypot(x, y) > 1e-9 * offset.norm()) angles.push_back(std::atan2(y, x));
  }
  std::sort(angles.begin(), angles.end());
  return angles;
}

// Where nothing is around a surfel: the middle of the widest gap between its neighbours, if that is
// wide enough for an end of the surface.
bool FindEnd(const Surfel& surfel, const std::vector<Surfel>& around, Eigen::Vector3d* direction) {
  constexpr double kMinGap = 135 * kRadian;
  const Eigen::Vector3d x_axis = surfel.normal.unitOrthogonal();
  const Eigen::Vector3d y_axis = surfel.normal.cross(x_axis);
  const std::vector<double> angles = AnglesAround(surfel, around, x_axis, y_axis);
  if (angles.size() < 2) return false;
  double widest = 0, middle = 0;
  for (size_t i = 0; i < angles.size(); ++i) {
    const double next = i + 1 < angles.size() ? angles[i + 1] : angles[0] + 360 * kRadian;
    if (next - angles[i] > widest) {
      widest = next - angles[i];
      middle = 0.5 * (next + angles[i]);
    }
  }
  *direction = std::cos(middle) * x_axis + std::sin(middle) * y_axis;
  return widest >= kMinGap;
}

// How many photos have the place within their frame. One that is hidden lies behind another
// surface, as where a wall meets the ground.
int CountPhotosTowards(const std::vector<DepthGrid>& grids,
                       const std::vector<Eigen::Vector3d>& centres, const Surfel& surfel,
                       double min_cos) {
  constexpr int kEnough = 2;
  int count = 0;
  for (size_t photo = 0; photo < grids.size() && count < kEnough; ++photo) {
    const Eigen::Vector3d ray = centres[photo] - surfel.beyond;
    if (ray.dot(surfel.normal) < min_cos * ray.norm()) continue;
    count += grids[photo].Look(surfel.beyond, 0) != DepthGrid::Sight::kOutside;
  }
  return count;
}

// Whether another face joins it here, as at the corner of a house or at the foot of a wall.
bool Turns(const Surfel& surfel, const std::vector<Surfel>& around) {
  constexpr double kMinCos = 0.7;
  return std::any_of(around.begin(), around.end(), [&](const Surfel& other) {
    return other.normal.dot(surfel.normal) < kMinCos;
  });
}

// How many photos look past the end at what lies behind it. Straight in front of the end none does;
// one that stands 30 degrees to its side does.
int CountPhotosAround(const std::vector<DepthGrid>& grids, const Surfel& surfel, double cell) {
  constexpr double kCellsBehind = 3;
  const Eigen::Vector3d behind = surfel.position - kCellsBehind * cell * surfel.normal;
  return static_cast<int>(std::count_if(grids.begin(), grids.end(), [&](const DepthGrid& grid) {
    return grid.Look(behind, 0) == DepthGrid::Sight::kSeen;
  }));
}

// Photos that look ahead are of what stands upright; the ground goes on without end.
bool LooksAhead(const GuidedMap& map, const Eigen::Vector3d& up) {
  double down = 0;
  for (const GuidedPhoto& photo : map.photos) {
    down -= AheadOf(photo.cam_from_world).dot(up);
  }
  return down < 0.5 * static_cast<double>(map.photos.size());
}

// Of what may lie beyond an end, around is left to a walk: what lies above a wall or below an edge
// is out of many photographers' reach, and would keep every place open.
void FindBorder(const std::vector<Eigen::Vector3d>& centres, const std::vector<DepthGrid>& grids,
                const std::vector<Surfel>& around, const Eigen::Vector3d& up,
                double max_incidence_deg, double cell, Surfel* surfel) {
  constexpr int kCellsBeyond = 2;
  constexpr double kSide = 45 * kRadian, kMaxUpright = 0.5, kMaxOffSideDeg = 25;
  Eigen::Vector3d direction;
  surfel->at_end = FindEnd(*surfel, around, &direction);
  if (!surfel->at_end) return;
  surfel->beyond = surfel->position + kCellsBeyond * cell * direction;
  surfel->beyond_max_deg = max_incidence_deg;
  surfel->open_border =
      CountPhotosTowards(grids, centres, *surfel, std::cos(max_incidence_deg * kRadian)) < 2;
  if (surfel->open_border) return;
  surfel->beyond = surfel->position;
  const bool may_walk_around =
      std::abs(direction.dot(up)) < kMaxUpright && std::abs(surfel->normal.dot(up)) < kMaxUpright;
  if (!may_walk_around || Turns(*surfel, around)) return;
  surfel->open_border = CountPhotosAround(grids, *surfel, cell) < 2;
  if (surfel->open_border) {
    surfel->beyond_normal = std::cos(kSide) * surfel->normal + std::sin(kSide) * direction;
    surfel->beyond_max_deg = kMaxOffSideDeg;
  }
}

void FindBorders(const SurfaceOptions& options, const GuidedMap& map,
                 const std::vector<Eigen::Vector3d>& centres, const std::vector<DepthGrid>& grids,
                 const SurfelCells& cells, Surface* surface) {
  constexpr int kRadius = 2;  // cells
  constexpr double kMinLevel = 0.7;
  const Eigen::Vector3d up = UpOf(map);
  const bool looks_ahead = LooksAhead(map, up);
  std::vector<Surfel> around;
  for (Surfel& surfel : surface->surfels) {
    around.clear();
    cells.VisitAround(surfel.position, kRadius, [&](uint32_t index) {
      const Surfel& other = surface->surfels[index];
      around.emplace_back();
      around.back().position = other.position;
      around.back().normal = other.normal;
    });
    if (looks_ahead && surfel.normal.dot(up) > kMinLevel) continue;
    FindBorder(centres, grids, around, up, options.max_incidence_deg, surface->cell, &surfel);
  }
}

// In cells as small as the points allow. What hides a surfel hides its parts, so they need no grids
// of their own, which would cost three times as much.
void AddParts(const SurfaceOptions& options, const GuidedMap& map, const Scale& scale,
              const std::vector<Eigen::Vector3d>& centres, const Sights& sights,
              const SurfelCells& cells, DetailedSurface* detailed) {
  SurfaceOptions of_parts = options;
  of_parts.points_per_cell = std::min(options.points_per_cell, kPointsPerPart);
  of_parts.min_cell_px = std::min(options.min_cell_px, kMinPartPx);
  const double min_cos = std::cos(options.max_incidence_deg * kRadian);
  detailed->part_width = CellWidth(of_parts, map, scale);
  for (Surfel& part : MakeSurfels(map, centres, PutIntoCells(map, detailed->part_width))) {
    const std::optional<uint32_t> found = cells.Find(part.position);
    if (!found) continue;
    const uint32_t whole = *found;
    const auto sees = [&](uint32_t photo) {
      return LooksAt(centres[photo], part, min_cos) &&
             sights.grids[photo].Look(part.position, options.depth_tolerance) ==
                 DepthGrid::Sight::kSeen;
    };
    AddPhotos(sights.photos[whole], sees, &part);
    detailed->parts.push_back(std::move(part));
    detailed->whole_of.push_back(whole);
  }
}

}  // namespace

Status SurfaceOptions::Check() const {
  return FirstError({InRange("points_per_cell", points_per_cell, 0.1, 1000.0),
                     InRange("min_cell_px", min_cell_px, 1.0, 1000.0),
                     InRange("max_cell_share", max_cell_share, 0.001, 1.0),
                     InRange("max_incidence_deg", max_incidence_deg, 1.0, 90.0),
                     InRange("depth_tolerance", depth_tolerance, 0.0, 1.0)});
}

DetailedSurface MakeSurface(const SurfaceOptions& options, const GuidedMap& map) {
  DetailedSurface detailed;
  const std::vector<Eigen::Vector3d> centres = CentresOf(map);
  const Scale scale = MeasureScale(map, centres);
  if (scale.median_gsd <= 0) return detailed;
  Surface& surface = detailed.surface;
  surface.median_gsd = scale.median_gsd;
  surface.working_distance = scale.working_distance;
  surface.cell = CellWidth(options, map, scale);
  surface.surfels = MakeSurfels(map, centres, PutIntoCells(map, surface.cell));
  const Sights sights = FindSights(options, map, surface);
  const double min_cos = std::cos(options.max_incidence_deg * kRadian);
  for (size_t i = 0; i < surface.surfels.size(); ++i) {
    Surfel& surfel = surface.surfels[i];
    AddPhotos(
        sights.photos[i], [&](uint32_t photo) { return LooksAt(centres[photo], surfel, min_cos); },
        &surfel);
  }
  const SurfelCells cells(surface);
  FindBorders(options, map, centres, sights.grids, cells, &surface);
  AddParts(options, map, scale, centres, sights, cells, &detailed);
  return detailed;
}

}  // namespace skein
