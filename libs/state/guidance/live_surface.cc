#include "guidance/live_surface.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

namespace skein {
namespace {

// With fewer points in and around a cell nothing can be said of its surface: these are more often
// wrong than not.
constexpr size_t kMinPointsOfNormal = 6;

constexpr int kEndRadius = 2;  // cells: as far as FindEnd looks

// A part's cell is some seven pixels wide, and bundle adjustment moves points by one or two.
constexpr double kPointPerTolerance = 2.5;  // in parts' cells
constexpr double kDrawnPerTolerance = 5;    // in cells: a surfel is drawn where it was until then

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

Eigen::Vector3d MeanOf(const std::vector<GuidedPoint>& points) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const GuidedPoint& point : points) mean += point.xyz;
  return mean / static_cast<double>(std::max<size_t>(1, points.size()));
}

bool HaveSameTexture(const GuidedPhoto& a, const GuidedPhoto& b) {
  return a.texture.has_value() == b.texture.has_value() &&
         (!a.texture || a.texture->bits == b.texture->bits);
}

bool IsSame(const CameraPose& a, const CameraPose& b) {
  return a.rotation.coeffs() == b.rotation.coeffs() && a.translation == b.translation;
}

std::vector<uint32_t> IndicesOf(const std::vector<bool>& flags) {
  std::vector<uint32_t> indices;
  for (uint32_t i = 0; i < flags.size(); ++i) {
    if (flags[i]) indices.push_back(i);
  }
  return indices;
}

bool AnyOf(const std::vector<uint32_t>& photos, const std::vector<bool>& flags) {
  return std::any_of(photos.begin(), photos.end(), [&](uint32_t photo) { return flags[photo]; });
}

}  // namespace

uint32_t LiveSurface::Population::Settle(uint32_t cell) {
  auto index = static_cast<uint32_t>(surfels.size());
  if (free.empty()) {
    surfels.emplace_back();
    cell_of.push_back(cell);
    for (auto* flags : {&reshaped, &changed, &only_photos_came, &other_observers}) {
      flags->push_back(false);
    }
    observers.emplace_back();
    came.emplace_back();
  } else {
    index = free.back();
    free.pop_back();
    cell_of[index] = cell;
  }
  if (cell >= of_cell.size()) of_cell.resize(cell + 1, kNone);
  of_cell[cell] = index;
  return index;
}

void LiveSurface::Population::Free(uint32_t index) {
  of_cell[cell_of[index]] = kNone;
  cell_of[index] = kNone;
  surfels[index] = Surfel::Gone();
  observers[index].clear();
  free.push_back(index);
}

void LiveSurface::Population::ClearFlags() {
  for (auto* flags : {&reshaped, &changed, &only_photos_came, &other_observers}) {
    flags->assign(surfels.size(), false);
  }
}

std::vector<LiveSurface::Change> LiveSurface::Population::TakeChanges() {
  std::vector<Change> changes;
  for (uint32_t i = 0; i < surfels.size(); ++i) {
    if (changed[i]) {
      changes.push_back({i, std::nullopt});
    } else if (only_photos_came[i]) {
      changes.push_back({i, std::exchange(came[i], {})});
    }
  }
  return changes;
}

void LiveSurface::Update(const GuidedMap& map) {
  TakeMap(map);
  if (scale_.median_gsd <= 0) return;
  std::swap(wholes_.surfels, surface_.surfels);
  wholes_.ClearFlags();
  parts_.ClearFlags();
  MakeWholes();
  if (any_moved_) DoubtEndsSeenBy(changes_.moved);
  sights_.Update(map_, changes_.moved);
  FindViewers();
  FindUp();
  FindEnds();
  JudgeEnds();
  MakeParts();
  FindViewersOfParts();
  changes_.surfels = wholes_.TakeChanges();
  changes_.parts = parts_.TakeChanges();
  std::swap(wholes_.surfels, surface_.surfels);
}

// What changed comes into the cells; or all, into cells of another width.
void LiveSurface::TakeMap(const GuidedMap& map) {
  changes_ = {};
  changes_.all = scale_.median_gsd <= 0 || !Continues(map);
  if (!changes_.all) {
    TakePhotos(map);
    TakePoints(map);
    if (given_scale_ || IsWithin(tolerance_, MeasureScale(map, num_observations_), scale_)) {
      return;
    }
    changes_.all = true;
  }
  Restart(map, given_scale_ ? *given_scale_ : MeasureScale(map, CountObservations(map)));
  if (scale_.median_gsd <= 0) return;
  TakePhotos(map);
  TakePoints(map);
}

bool LiveSurface::Continues(const GuidedMap& map) const {
  if (map.photos.size() < map_.photos.size() || map.cameras.size() < map_.cameras.size() ||
      map.points.size() < map_.points.size()) {
    return false;
  }
  return std::equal(map_.photos.begin(), map_.photos.end(), map.photos.begin(),
                    [](const GuidedPhoto& before, const GuidedPhoto& now) {
                      return before.image_id == now.image_id && before.camera == now.camera;
                    });
}

void LiveSurface::Restart(const GuidedMap& map, const PlaceScale& scale) {
  scale_ = scale;
  map_ = {};
  centres_.clear();
  num_observations_.clear();
  const Eigen::Vector3d origin = MeanOf(map.points);
  wholes_ = {};
  parts_ = {};
  wholes_.cells = PointCells(scale.cell, origin, kEndRadius);
  parts_.cells = PointCells(scale.part_cell, origin);
  whole_of_.clear();
  ends_.clear();
  ends_to_find_.clear();
  ends_to_judge_.clear();
  up_.setZero();
  sights_ = Sights(scale.cell, scale.working_distance, kDrawnPerTolerance * tolerance_);
  surface_ = {scale.cell, scale.median_gsd, scale.working_distance, {}};
}

// Whether a point in the frame moves by more than the tolerance of a square of a photo's grid.
bool LiveSurface::HasMoved(const GuidedPhoto& before, const GuidedPhoto& now) const {
  const CameraPose &a = before.cam_from_world, &b = now.cam_from_world;
  if (IsSame(a, b)) return false;
  const double shift = (a.Centre() - b.Centre()).norm() / scale_.working_distance;
  const double turn = a.rotation.angularDistance(b.rotation);
  return shift + turn > tolerance_ * scale_.cell / scale_.working_distance;
}

// Returns those, by index, that are no longer held.
std::vector<bool> LiveSurface::TakeCameras(const GuidedMap& map) {
  std::vector<bool> moved(map.cameras.size(), false);
  for (size_t i = 0; i < map_.cameras.size(); ++i) {
    const GuidedCamera &a = map_.cameras[i], &b = map.cameras[i];
    const double growth =
        std::max(std::abs(b.fx_px / a.fx_px - 1), std::abs(b.fy_px / a.fy_px - 1));
    const double shift_px = std::max(std::abs(b.cx_px - a.cx_px), std::abs(b.cy_px - a.cy_px)) +
                            0.5 * std::max(a.width_px, a.height_px) * growth;
    const double square_px = scale_.cell * a.FocalPx() / scale_.working_distance;
    moved[i] =
        shift_px > tolerance_ * square_px || a.width_px != b.width_px || a.height_px != b.height_px;
    if (moved[i]) map_.cameras[i] = b;
  }
  map_.cameras.insert(map_.cameras.end(),
                      map.cameras.begin() + static_cast<ptrdiff_t>(map_.cameras.size()),
                      map.cameras.end());
  return moved;
}

void LiveSurface::TakePhotos(const GuidedMap& map) {
  num_known_photos_ = map_.photos.size();
  const std::vector<bool> moved_cameras = TakeCameras(map);
  changes_.moved.assign(map.photos.size(), false);
  changes_.other_observations.assign(map.photos.size(), false);
  any_moved_ = false;
  for (size_t i = 0; i < map.photos.size(); ++i) {
    const GuidedPhoto& now = map.photos[i];
    const bool is_new = i >= num_known_photos_;
    if (!is_new) {
      GuidedPhoto& before = map_.photos[i];
      before.agent = now.agent;
      changes_.moved[i] =
          moved_cameras[now.camera] || !HaveSameTexture(before, now) || HasMoved(before, now);
      if (!changes_.moved[i]) continue;
      any_moved_ = true;
      before = now;
      centres_[i] = now.cam_from_world.Centre();
    } else {
      map_.photos.push_back(now);
      centres_.push_back(now.cam_from_world.Centre());
    }
    changes_.other_observations[i] = true;
  }
  num_observations_.resize(map.photos.size(), 0);
}

void LiveSurface::TakePoints(const GuidedMap& map) {
  map_.points.resize(map.points.size());
  for (uint32_t i = 0; i < map.points.size(); ++i) TakePoint(i, map.points[i]);
}

void LiveSurface::TakePoint(uint32_t index, const GuidedPoint& now) {
  GuidedPoint& held = map_.points[index];
  const bool was = !held.photos.empty(), is = !now.photos.empty();
  const double max_move = kPointPerTolerance * tolerance_ * scale_.part_cell;
  const bool moves = was != is || (held.xyz - now.xyz).squaredNorm() > max_move * max_move;
  if ((!was && !is) || (!moves && held.photos == now.photos && !any_moved_)) return;
  const bool changes = moves || held.photos != now.photos;
  if (!changes && !AnyMoved(now.photos)) return;
  if (changes) NoteObservations(held.photos, now.photos, moves);
  for (PointCells* cells : {&wholes_.cells, &parts_.cells}) {
    if (moves && was) cells->Remove(index, held.xyz);
    if (moves && is) cells->Add(index, now.xyz);
    if (!moves) cells->Touch(held.xyz);
  }
  held.photos = now.photos;
  if (moves) held.xyz = now.xyz;
}

// Of a point, before and now.
void LiveSurface::NoteObservations(const std::vector<uint32_t>& before,
                                   const std::vector<uint32_t>& now, bool moves) {
  for (const uint32_t photo : before) --num_observations_[photo];
  for (const uint32_t photo : now) ++num_observations_[photo];
  std::vector<uint32_t> changed;
  if (moves) {
    std::set_union(before.begin(), before.end(), now.begin(), now.end(),
                   std::back_inserter(changed));
  } else {
    std::set_symmetric_difference(before.begin(), before.end(), now.begin(), now.end(),
                                  std::back_inserter(changed));
  }
  for (const uint32_t photo : changed) changes_.other_observations[photo] = true;
}

// None where the points are too few.
std::optional<Surfel> LiveSurface::MakeSurfel(const PointCells& cells, uint32_t cell) const {
  const std::vector<uint32_t>& points = cells.PointsOf(cell);
  const Moments around = cells.MomentsAround(cell);
  if (points.empty() || around.count < kMinPointsOfNormal) return std::nullopt;
  Surfel surfel;
  for (const uint32_t point : points) surfel.position += map_.points[point].xyz;
  surfel.position /= static_cast<double>(points.size());
  surfel.num_points = static_cast<uint32_t>(points.size());
  surfel.photos = observers_.Of(points);
  Eigen::Vector3d towards = Eigen::Vector3d::Zero();
  for (const uint32_t photo : surfel.photos) {
    towards += (centres_[photo] - surfel.position).normalized();
  }
  if (towards.norm() < 1e-9) towards = Eigen::Vector3d::UnitZ();
  surfel.normal = NormalOf(around, towards.normalized());
  surfel.area = AreaOf(cells.width(), surfel.normal);
  surfel.beyond = surfel.position;
  surfel.beyond_normal = surfel.normal;
  return surfel;
}

bool LiveSurface::IsHeld(const Surfel& before, const Surfel& now, double width) const {
  return (before.position - now.position).norm() <= tolerance_ * width &&
         (before.normal - now.normal).norm() <= tolerance_;
}

// A part is where a whole surfel is, so parts come and go with it. One has its points in the cell
// of its whole and in those beside it.
void LiveSurface::TouchPartsIn(uint32_t cell) {
  wholes_.cells.VisitBeside(cell, [&](uint32_t beside) {
    for (const uint32_t point : wholes_.cells.PointsOf(beside)) {
      parts_.cells.Touch(map_.points[point].xyz);
    }
  });
}

// made: the surfel of the cell as it is now, as far as its points tell.
void LiveSurface::Remake(uint32_t cell, std::optional<Surfel> made, Population* population) {
  uint32_t index = population->Find(cell);
  const bool lived = index != Population::kNone;
  if (!made && !lived) return;
  if (made && !lived) index = population->Settle(cell);
  Surfel& surfel = population->surfels[index];
  population->changed[index] = population->changed[index] || !made || !lived;
  if (!made) {
    population->reshaped[index] = true;
    population->Free(index);
    return;
  }
  surfel.num_points = made->num_points;
  population->observers[index] = std::exchange(made->photos, {});
  population->other_observers[index] = true;
  if (lived && IsHeld(surfel, *made, population->cells.width())) return;
  population->reshaped[index] = population->changed[index] = true;
  made->photos = std::move(surfel.photos);
  surfel = std::move(*made);
}

void LiveSurface::MakeWholes() {
  constexpr double kNowhere = std::numeric_limits<double>::quiet_NaN();
  reshaped_cells_.clear();
  for (const uint32_t cell : wholes_.cells.TakeTouched(map_.points)) {
    const uint32_t before = wholes_.Find(cell);
    const bool lived = before != Population::kNone;
    const Eigen::Vector3d old_position =
        lived ? wholes_.surfels[before].position : Eigen::Vector3d::Constant(kNowhere);
    Remake(cell, MakeSurfel(wholes_.cells, cell), &wholes_);
    const uint32_t index = wholes_.Find(cell);
    const bool lives = index != Population::kNone;
    if (lived != lives) TouchPartsIn(cell);
    if (!lived && !lives) continue;
    const uint32_t either = lives ? index : before;
    if (!wholes_.reshaped[either]) continue;
    reshaped_cells_.push_back(cell);
    const Eigen::Vector3d position =
        lives ? wholes_.surfels[index].position : Eigen::Vector3d::Constant(kNowhere);
    if (!(position == old_position)) sights_.Place(either, position);
  }
}

bool LiveSurface::LooksAt(uint32_t photo, const Surfel& surfel) const {
  const Eigen::Vector3d ray = centres_[photo] - surfel.position;
  return ray.dot(surfel.normal) >= min_cos_ * ray.norm();
}

// Those of `sights` for which `sees` holds, beside those that observe the surfel.
template <typename Sees>
std::vector<uint32_t> LiveSurface::PhotosOf(const Population& population, uint32_t index,
                                            const std::vector<uint32_t>& sights, const Sees& sees) {
  const std::vector<uint32_t>& observers = population.observers[index];
  std::vector<uint32_t> all;
  all.reserve(observers.size() + sights.size());
  auto observer = observers.begin();
  for (const uint32_t photo : sights) {
    while (observer != observers.end() && *observer < photo) all.push_back(*observer++);
    if (observer != observers.end() && *observer == photo) continue;
    if (sees(photo)) all.push_back(photo);
  }
  all.insert(all.end(), observer, observers.end());
  return all;
}

void LiveSurface::SetPhotos(uint32_t index, std::vector<uint32_t> photos, Population* population) {
  Surfel& surfel = population->surfels[index];
  if (AnyMoved(photos)) population->changed[index] = true;
  if (surfel.photos == photos) return;
  if (std::includes(photos.begin(), photos.end(), surfel.photos.begin(), surfel.photos.end())) {
    population->only_photos_came[index] = true;
    population->came[index].clear();
    std::set_difference(photos.begin(), photos.end(), surfel.photos.begin(), surfel.photos.end(),
                        std::back_inserter(population->came[index]));
  } else {
    population->changed[index] = true;
  }
  surfel.photos = std::move(photos);
}

bool LiveSurface::AnyMoved(const std::vector<uint32_t>& photos) const {
  return any_moved_ && AnyOf(photos, changes_.moved);
}

void LiveSurface::FindViewers() {
  for (uint32_t i = 0; i < wholes_.surfels.size(); ++i) {
    const Surfel& surfel = wholes_.surfels[i];
    if (surfel.IsGone()) continue;
    const std::vector<uint32_t>& sights = sights_.PhotosOf(i);
    if (!wholes_.other_observers[i] && !sights_.HasOtherPhotos(i) && !AnyMoved(sights) &&
        !AnyMoved(surfel.photos)) {
      continue;
    }
    const auto sees = [&](uint32_t photo) { return LooksAt(photo, surfel); };
    SetPhotos(i, PhotosOf(wholes_, i, sights, sees), &wholes_);
  }
}

void LiveSurface::FindUp() {
  constexpr double kShare = 0.1;  // of the tolerance, in radians
  const Eigen::Vector3d up = UpOf(map_);
  const bool is_other = (up - up_).norm() > kShare * tolerance_;
  if (is_other) up_ = up;
  const bool looks_ahead = LooksAhead(map_, up_);
  const size_t num_surfels = wholes_.surfels.size();
  ends_.resize(num_surfels);
  ends_to_judge_.resize(num_surfels, false);
  ends_to_find_.assign(num_surfels, is_other || looks_ahead != looks_ahead_);
  looks_ahead_ = looks_ahead;
}

void LiveSurface::FindEnds() {
  const auto visit_around = [&](uint32_t cell, const auto& visit) {
    wholes_.cells.VisitNear(cell, [&](uint32_t other) {
      const uint32_t index = wholes_.Find(other);
      if (index != Population::kNone) visit(index);
    });
  };
  for (const uint32_t cell : reshaped_cells_) {
    visit_around(cell, [&](uint32_t index) { ends_to_find_[index] = true; });
  }
  std::vector<const Surfel*> around;
  for (uint32_t i = 0; i < wholes_.surfels.size(); ++i) {
    if (!ends_to_find_[i] || wholes_.surfels[i].IsGone()) continue;
    around.clear();
    visit_around(wholes_.cell_of[i],
                 [&](uint32_t index) { around.push_back(&wholes_.surfels[index]); });
    ends_[i] = FindEnd(wholes_.surfels[i], around, up_, looks_ahead_);
    ends_to_judge_[i] = true;
  }
}

// may_depend(borders, photo, end, surfel)
template <typename MayDepend>
void LiveSurface::DoubtEnds(const std::vector<bool>& photos, const MayDepend& may_depend) {
  const Borders borders(centres_, sights_, scale_.cell);
  const std::vector<uint32_t> indices = IndicesOf(photos);
  ends_to_judge_.resize(wholes_.surfels.size(), false);
  for (uint32_t i = 0; i < ends_.size(); ++i) {
    if (!ends_[i].is_end || ends_to_judge_[i] || wholes_.surfels[i].IsGone()) continue;
    ends_to_judge_[i] = std::any_of(indices.begin(), indices.end(), [&](uint32_t photo) {
      return may_depend(borders, photo, ends_[i], wholes_.surfels[i]);
    });
  }
}

// By photos as their poses are now.
void LiveSurface::DoubtEndsSeenBy(const std::vector<bool>& photos) {
  DoubtEnds(photos, [](const Borders& borders, uint32_t photo, const End& end,
                       const Surfel& surfel) { return borders.MayDependOn(photo, end, surfel); });
}

void LiveSurface::JudgeEnds() {
  std::vector<bool> placed = changes_.moved, has_other_grid(map_.photos.size(), false);
  for (uint32_t photo = 0; photo < placed.size(); ++photo) {
    has_other_grid[photo] = sights_.HasOtherGrid(photo);
    if (photo >= num_known_photos_) placed[photo] = true;
  }
  DoubtEndsSeenBy(placed);
  DoubtEnds(has_other_grid,
            [](const Borders& borders, uint32_t photo, const End& end, const Surfel& surfel) {
              return borders.MayDependOnGridOf(photo, end, surfel);
            });
  const Borders borders(centres_, sights_, scale_.cell);
  for (uint32_t i = 0; i < ends_.size(); ++i) {
    if (!ends_to_judge_[i] || wholes_.surfels[i].IsGone()) continue;
    borders.Judge(ends_[i], &wholes_.surfels[i]);
  }
  ends_to_judge_.assign(ends_.size(), false);
}

// In cells as small as the points allow.
void LiveSurface::MakeParts() {
  for (const uint32_t cell : parts_.cells.TakeTouched(map_.points)) {
    std::optional<Surfel> made = MakeSurfel(parts_.cells, cell);
    const uint32_t whole =
        made ? wholes_.Find(wholes_.cells.Find(made->position)) : Population::kNone;
    if (whole == Population::kNone) made.reset();
    Remake(cell, std::move(made), &parts_);
    const uint32_t index = parts_.Find(cell);
    if (index == Population::kNone) continue;
    whole_of_.resize(parts_.surfels.size(), Population::kNone);
    if (std::exchange(whole_of_[index], whole) != whole) parts_.changed[index] = true;
  }
}

bool LiveSurface::IsSeenFrom(uint32_t photo, const Surfel& part) const {
  return LooksAt(photo, part) &&
         sights_.GridOf(photo).Look(part.position, kDepthTolerance) == DepthGrid::Sight::kSeen;
}

// False may be wrong: of a photo that observes the part and has nothing of it in view.
bool LiveSurface::SeesAsBefore(uint32_t index, const std::vector<bool>& photos) const {
  const Surfel& part = parts_.surfels[index];
  const std::vector<uint32_t>& sights = sights_.PhotosOf(whole_of_[index]);
  return std::all_of(sights.begin(), sights.end(), [&](uint32_t photo) {
    return !photos[photo] || IsSeenFrom(photo, part) ==
                                 std::binary_search(part.photos.begin(), part.photos.end(), photo);
  });
}

// What hides a surfel hides its parts, so they need no grids of their own, which would cost three
// times as much.
void LiveSurface::FindViewersOfParts() {
  std::vector<bool> in_doubt(wholes_.surfels.size(), false);
  std::vector<bool> photos(map_.photos.size(), false);  // with another grid
  for (uint32_t photo = 0; photo < photos.size(); ++photo) {
    photos[photo] = sights_.HasOtherGrid(photo);
  }
  for (uint32_t i = 0; i < in_doubt.size(); ++i) in_doubt[i] = AnyOf(sights_.PhotosOf(i), photos);
  for (uint32_t i = 0; i < parts_.surfels.size(); ++i) {
    const Surfel& part = parts_.surfels[i];
    if (part.IsGone()) continue;
    const uint32_t whole = whole_of_[i];
    const std::vector<uint32_t>& sights = sights_.PhotosOf(whole);
    const bool is_other = parts_.changed[i] || parts_.other_observers[i] ||
                          sights_.HasOtherPhotos(whole) || AnyMoved(part.photos) ||
                          AnyMoved(sights);
    if (!is_other && (!in_doubt[whole] || SeesAsBefore(i, photos))) continue;
    SetPhotos(i,
              PhotosOf(parts_, i, sights, [&](uint32_t photo) { return IsSeenFrom(photo, part); }),
              &parts_);
  }
}

}  // namespace skein
