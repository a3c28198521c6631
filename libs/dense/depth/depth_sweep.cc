#include "depth/depth_sweep.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "core/clock.h"
#include "depth/bare_areas.h"
#include "depth/depth_regions.h"
#include "depth/padded_rows.h"
#include "depth/warped_view.h"

namespace skein {
namespace {

constexpr int kCensusThreshold = 2;  // grey levels
constexpr int kTruncation = 4;       // of kCensusBits, of a neighbour's cost above the best one's
// Penalties of a path, of a neighbour: of a change of depth by one step, and of a larger one.
constexpr int kSmallPenalty = 4, kLargePenalty = 40;
static_assert(kTruncation + kSmallPenalty + kLargePenalty <=
              kMaxPathCost / kMaxSweepViews - kCensusBits);
// A depth is a hole unless the sum of the paths' costs two steps away or more is this share higher,
// and the cost at its step is this share below the mean over all steps around it.
constexpr double kMinUniqueness = 0.06, kMinEvidence = 0.06;

// Pixels by which a plane moves a neighbour's pixel more than the one beside it, at least, that
// parallel planes z = const miss it.
constexpr double kMinSlope = 0.5;
constexpr int kStopRows = 16;  // rows between two questions whether to stop
constexpr int kEvidenceWindow = 5;
constexpr int kRegionMarginPx = 8;  // around a region, where paths begin
// Standard errors: of a match with the least evidence that is kept, less by the power of 0.75 with
// more evidence; of a sub-step (measured: docs/experiments/depth.md).
constexpr double kMatchErrorPx = 1;
constexpr double kSubStepError = 0.24;  // of a step

// Adds the CPU time of its life.
class PartTimer {
 public:
  explicit PartTimer(double* sum) : sum_(sum) {}
  ~PartTimer() { *sum_ += ThreadCpuS() - start_s_; }
  PartTimer(const PartTimer&) = delete;
  PartTimer& operator=(const PartTimer&) = delete;

 private:
  double* sum_;
  const double start_s_ = ThreadCpuS();
};

void CheckInput(const DepthPhoto& photo, const std::vector<const DepthPhoto*>& neighbours,
                const DepthRange& range) {
  if (!(range.near > 0 && range.near < range.far && std::isfinite(range.far))) {
    throw std::invalid_argument("depth map: give depths 0 < near < far");
  }
  if (!std::all_of(range.planes.begin(), range.planes.end(),
                   [](const Eigen::Vector3d& plane) { return plane.allFinite(); })) {
    throw std::invalid_argument("depth map: a plane is not finite");
  }
  const bool sound = IsSound(photo) && std::all_of(neighbours.begin(), neighbours.end(),
                                                   [](const auto* n) { return IsSound(*n); });
  if (!sound) {
    throw std::invalid_argument("depth map: pixels, camera and pose of a photo do not fit");
  }
}

}  // namespace

int64_t DepthSweepBytes(int width, int height, int steps, int neighbours) {
  const int64_t pixels = int64_t{RoundUp(width, 64)} * (height + 1);
  return 3 * pixels * steps + 40 * pixels * (1 + neighbours);
}

class DepthSweep::Workspace {
 public:
  explicit Workspace(InstructionSet kernel) : kernels_(SweepKernelsOf(kernel)) {}

  // From coarse to fine.
  std::optional<DepthMap> Run(const DepthPhoto& photo,
                              const std::vector<const DepthPhoto*>& neighbours,
                              const SweepPlanes& planes, const DepthStop& stop) {
    const bool is_small = std::min(photo.camera.width, photo.camera.height) < 2 * kMinRegionPx;
    if (is_small || LongestSearchPx(photo, neighbours, planes) < kMaxFamilySteps) {
      return Sweep(photo, neighbours, WholeSearch(photo, neighbours, planes), kMinSweepSteps, stop);
    }
    const std::optional<DepthMap> coarse = RunHalved(photo, neighbours, planes, stop);
    if (!coarse) return std::nullopt;
    return SweepRegions(photo, neighbours, planes, *coarse, stop);
  }

  // given: DepthRange::planes.
  void Reset(const std::vector<Eigen::Vector3d>& given) {
    times_ = {};
    given_ = given;
  }
  const DepthTimes& times() const { return times_; }
  int steps() const { return steps_; }

 private:
  // ---- From coarse to fine ----

  static double LongestSearchPx(const DepthPhoto& photo,
                                const std::vector<const DepthPhoto*>& neighbours,
                                const SweepPlanes& planes) {
    double longest = 0;
    for (const DepthPhoto* neighbour : neighbours) {
      longest = std::max(longest, SearchLengthPx(photo, *neighbour, planes));
    }
    return longest;
  }

  // All of the range by one slope, and what lies around each given plane whose slope that misses.
  std::vector<SweepPlanes> WholeSearch(const DepthPhoto& photo,
                                       const std::vector<const DepthPhoto*>& neighbours,
                                       const SweepPlanes& whole) const {
    std::vector<SweepPlanes> families = {whole};
    const double search = LongestSearchPx(photo, neighbours, whole);
    if (!(search > 0)) return families;
    const double px = (whole.last - whole.first) / search;
    const double ends = (kSweepLanes - 1) * px / 2;
    for (const Eigen::Vector3d& plane : given_) {
      const Eigen::Vector2d slope = plane.head<2>();
      if (slope.cwiseQuotient(photo.camera.focal_px).norm() < kMinSlope * px) continue;
      families.push_back({plane.z() - ends, plane.z() + ends, slope, Eigen::Vector2d::Zero()});
    }
    return families;
  }

  std::optional<DepthMap> RunHalved(const DepthPhoto& photo,
                                    const std::vector<const DepthPhoto*>& neighbours,
                                    const SweepPlanes& planes, const DepthStop& stop) {
    std::vector<DepthPhoto> halved;
    for (const DepthPhoto* neighbour : neighbours) halved.push_back(Halved(*neighbour));
    std::vector<const DepthPhoto*> pointers;
    for (const DepthPhoto& neighbour : halved) pointers.push_back(&neighbour);
    return Run(Halved(photo), pointers, planes, stop);
  }

  std::optional<DepthMap> SweepRegions(const DepthPhoto& photo,
                                       const std::vector<const DepthPhoto*>& neighbours,
                                       const SweepPlanes& planes, const DepthMap& coarse,
                                       const DepthStop& stop) {
    DepthMap map = HolesOf(photo);
    const auto search_px = [&](const cv::Rect& area, const SweepPlanes& planes) {
      return LongestSearchPx(Cropped(photo, area), neighbours, planes);
    };
    for (const DepthRegion& region : RegionsOf(photo, coarse, planes, kMaxFamilySteps, search_px)) {
      const cv::Rect around = Around(region.area) & cv::Rect(cv::Point(), map.depth.size());
      const DepthPhoto part = Cropped(photo, around);
      const auto found = Sweep(part, neighbours, region.families, kSweepLanes, stop);
      if (!found) return std::nullopt;
      const cv::Rect inside(region.area.tl() - around.tl(), region.area.size());
      found->depth(inside).copyTo(map.depth(region.area));
      found->error(inside).copyTo(map.error(region.area));
    }
    const cv::Mat1b is_beyond = (map.depth < 1 / planes.last) | (map.depth > 1 / planes.first);
    map.MakeHoles(is_beyond);
    return map;
  }

  static cv::Rect Around(const cv::Rect& area) {
    return {area.x - kRegionMarginPx, area.y - kRegionMarginPx, area.width + 2 * kRegionMarginPx,
            area.height + 2 * kRegionMarginPx};
  }

  // ---- One sweep ----

  std::optional<DepthMap> Sweep(const DepthPhoto& photo,
                                const std::vector<const DepthPhoto*>& neighbours,
                                const std::vector<SweepPlanes>& families, int min_steps,
                                const DepthStop& stop) {
    photo_ = &photo;
    min_steps_ = min_steps;
    width_ = photo.camera.width;
    height_ = photo.camera.height;
    MakeFamilies(families, neighbours);
    DepthMap map = HolesOf(photo);
    if (num_views_ == 0) return map;
    const bool is_done = SumCosts(stop) && AddPaths(1, stop) && AddPaths(-1, stop);
    if (!is_done) return std::nullopt;
    FillMap(&map);
    return map;
  }

  // Planes of one slope, and the neighbours as their middle plane shows them.
  struct Family {
    SweepPlanes planes;
    std::vector<WarpedView> views;
    int first_step = 0, steps = 0;
    double step_size = 0;

    double PlaneOf(double step) const { return planes.first + step * step_size; }
    double InverseDepth(const Eigen::Vector2d& ray, double step) const {
      return planes.InverseDepth(ray, PlaneOf(step));
    }
    // By which all neighbours move for a unit of inverse depth, taken together.
    double Parallax(const Eigen::Vector2d& ray, double step) const {
      double sum = 0;
      for (const WarpedView& view : views) sum += view.SquaredParallax(ray, PlaneOf(step));
      return std::sqrt(sum);
    }
  };

  void MakeFamilies(const std::vector<SweepPlanes>& families,
                    const std::vector<const DepthPhoto*>& neighbours) {
    const PartTimer timer(&times_.warp);
    const std::vector<const DepthPhoto*> matched = WithParallax(families, neighbours);
    num_views_ = static_cast<int>(matched.size());
    families_.clear();
    steps_ = 0;
    for (const SweepPlanes& planes : families) AddFamily(planes, matched);
  }

  std::vector<const DepthPhoto*> WithParallax(
      const std::vector<SweepPlanes>& families,
      const std::vector<const DepthPhoto*>& neighbours) const {
    std::vector<const DepthPhoto*> matched;
    for (const DepthPhoto* neighbour : neighbours) {
      if (matched.size() == kMaxSweepViews) break;
      const bool has =
          std::any_of(families.begin(), families.end(), [&](const SweepPlanes& planes) {
            return SearchLengthPx(*photo_, *neighbour, planes) >= kMinSearchPx;
          });
      if (has) matched.push_back(neighbour);
    }
    return matched;
  }

  void AddFamily(const SweepPlanes& planes, const std::vector<const DepthPhoto*>& matched) {
    Family family;
    family.planes = planes;
    double longest = 0;
    for (const DepthPhoto* neighbour : matched) {
      family.views.emplace_back(*photo_, *neighbour, planes);
      longest = std::max(longest, family.views.back().SearchLengthPx());
    }
    const int least = families_.empty() ? min_steps_ : kSweepLanes;
    const int wanted = RoundUp(std::max(static_cast<int>(longest) + 1, least), kSweepLanes);
    family.steps = std::min({wanted, kMaxFamilySteps, kMaxSweepSteps - steps_});
    if (family.steps == 0) return;  // no room
    family.step_size = (planes.last - planes.first) / (family.steps - 1);
    family.first_step = steps_;
    steps_ += family.steps;
    families_.push_back(std::move(family));
  }

  // ---- Costs: [row][step][column], of each plane at a time, then [row][column][step] ----

  bool SumCosts(const DepthStop& stop) {
    stride_ = RoundUp(width_, 64);
    costs_.resize(RowBytes() * (height_ + 1) + kSweepMargin);
    PadReference();
    for (Family& family : families_) {
      for (int i = 0; i < family.steps; ++i) {
        if (stop && stop()) return false;
        SumCostsOf(i, &family);
      }
    }
    return true;
  }

  void PadReference() {
    reference_.Resize(width_, height_ + 2 * kCensusRadius);
    for (int y = -kCensusRadius; y < height_ + kCensusRadius; ++y) {
      const uint8_t* from = photo_->grey[std::clamp(y, 0, height_ - 1)];
      uint8_t* to = reference_.Row(y + kCensusRadius);
      std::fill(to - kSweepMargin, to, from[0]);
      std::copy(from, from + width_, to);
      std::fill(to + width_, to + width_ + kSweepMargin, from[width_ - 1]);
    }
  }

  uint8_t* CostRow(int step, int y) {
    return costs_.data() + (y + 1) * RowBytes() + static_cast<size_t>(step) * stride_;
  }

  // [column][step], where the row before had its [step][column].
  uint8_t* TransposedRow(int y) { return costs_.data() + y * RowBytes(); }

  // A cache line more than the steps take: rows a power of two apart would share cache sets.
  size_t RowBytes() const { return static_cast<size_t>(stride_) * steps_ + 64; }

  void SumCostsOf(int i, Family* family) {
    const PartTimer timer(&times_.costs);
    std::vector<WarpedView>& views = family->views;
    warped_.Resize(width_ + 2 * kWarpBorder + 2 * kSweepMargin, num_views_ * kCensusRows);
    int widest = 0;
    for (WarpedView& view : views) {
      view.SetPlane(family->PlaneOf(i));
      widest = std::max(widest, view.source_width());
    }
    warp_scratch_.Resize(widest + kSweepLanes, num_views_);
    census_scratch_.resize(static_cast<size_t>(num_views_) * (width_ + kSweepMargin) +
                           kSweepMargin);
    for (int y = -kCensusRadius; y < height_ + kCensusRadius; ++y) {
      WarpRowsOf(views, y);
      if (y >= kCensusRadius) CensusRowOf(views, family->first_step + i, y - kCensusRadius);
    }
  }

  // Rows of the warped neighbours are kept in a ring.
  uint8_t* WarpedRow(int view, int y) {
    return warped_.Row(view * kCensusRows + (y + kCensusRows) % kCensusRows) + kWarpBorder;
  }

  void WarpRowsOf(const std::vector<WarpedView>& views, int y) {
    WarpTask tasks[kMaxSweepViews] = {};
    int count = 0;
    for (int i = 0; i < num_views_; ++i) {
      if (!views[i].ShowsRow(y)) continue;
      WarpTask& task = tasks[count++];
      views[i].FillRow(y, &task);
      task.scratch = warp_scratch_.Row(i) - kSweepMargin;
      task.out = WarpedRow(i, y) - kWarpBorder;
    }
    kernels_.warp(tasks, count);
  }

  void CensusRowOf(const std::vector<WarpedView>& views, int step, int y) {
    CensusTask task = {};
    task.num_views = num_views_;
    for (int k = 0; k < kCensusRows; ++k) {
      task.reference[k] = reference_.Row(y + k);
      for (int i = 0; i < task.num_views; ++i) {
        task.views[i][k] = WarpedRow(i, y + k - kCensusRadius);
      }
    }
    for (int i = 0; i < task.num_views; ++i) views[i].Range(y, &task.first[i], &task.last[i]);
    task.threshold = kCensusThreshold;
    task.truncation = kTruncation;
    task.width = width_;
    task.scratch = census_scratch_.data();
    task.out = CostRow(step, y);
    kernels_.census(task);
  }

  // ---- Paths: down with direction 1, then up with -1 ----

  bool AddPaths(int direction, const DepthStop& stop) {
    sums_.resize(static_cast<size_t>(width_) * height_ * steps_);
    const size_t column = steps_ + 2 * kSweepLanes;
    for (auto& state : states_) {
      for (auto& costs : state.costs) costs.assign((width_ + 2) * column, 0);
      for (auto& least : state.least) least.assign(width_ + 2, 0);
    }
    SetUpBorders(column);
    path_scratch_.resize(2 * column);
    row_sums_.resize(static_cast<size_t>(width_) * steps_);
    SetPenalties();
    choices_.resize(static_cast<size_t>(width_) * height_);
    for (auto& row : row_choices_) row.resize(width_);
    for (int i = 0; i < height_; ++i) {
      if (i % kStopRows == 0 && stop && stop()) return false;
      const int y = direction > 0 ? i : height_ - 1 - i;
      AddPathsOfRow(y, i == 0, direction);
      if (direction < 0) ChooseRow(y);
    }
    return true;
  }

  // Bytes beside the steps, as the kernel leaves them: no path comes from there.
  void SetUpBorders(size_t column) {
    const uint8_t pad = static_cast<uint8_t>(255 - SmallPenalty());
    for (auto& costs : states_[0].costs) {
      for (size_t at = 0; at < costs.size(); at += column) {
        std::fill_n(costs.begin() + at, kSweepLanes, pad);
        std::fill_n(costs.begin() + at + kSweepLanes + steps_, kSweepLanes, pad);
      }
    }
  }

  int SmallPenalty() const { return kSmallPenalty * num_views_; }

  // Less where the photo has an edge: depth may have one, too.
  void SetPenalties() {
    for (int difference = 0; difference < 256; ++difference) {
      const int large = kLargePenalty * num_views_ * 16 / (16 + difference);
      penalties_[difference] = static_cast<uint8_t>(std::max(large, SmallPenalty() + 1));
    }
  }

  void TransposeRow(int y) {
    const uint8_t* rows[kMaxSweepSteps];
    for (int step = 0; step < steps_; ++step) rows[step] = CostRow(step, y);
    kernels_.transpose({rows, width_, steps_, TransposedRow(y)});
  }

  void AddPathsOfRow(int y, bool is_first, int direction) {
    const PartTimer timer(&times_.paths);
    if (direction > 0) TransposeRow(y);
    PathTask task = {};
    task.cost = TransposedRow(y);
    task.grey = reference_.Row(y + kCensusRadius);
    task.grey_before = is_first ? nullptr : reference_.Row(y + kCensusRadius - direction);
    task.width = width_;
    task.steps = steps_;
    task.direction = direction;
    task.small_penalty = SmallPenalty();
    task.large_penalty = penalties_;
    for (int k = 0; k < 3; ++k) {
      task.before[k] = states_[0].costs[k].data();
      task.before_min[k] = states_[0].least[k].data();
      task.now[k] = states_[1].costs[k].data();
      task.now_min[k] = states_[1].least[k].data();
    }
    task.scratch = path_scratch_.data();
    task.sum_before = direction > 0 ? nullptr : SumRow(y);
    task.sum = direction > 0 ? SumRow(y) : row_sums_.data();
    kernels_.paths(task);
    std::swap(states_[0], states_[1]);
  }

  uint16_t* SumRow(int y) { return sums_.data() + static_cast<size_t>(y) * width_ * steps_; }

  // The best step of a pixel, of all families.
  struct Choice {
    uint8_t family = 0;
    StepChoice at;        // `step` counts from the family's first
    uint16_t second = 0;  // the least sum of another depth
    float mean = 0;       // of the costs
  };

  void ChooseRow(int y) {
    const PartTimer timer(&times_.choice);
    for (size_t f = 0; f < families_.size(); ++f) {
      const Family& family = families_[f];
      kernels_.choose({row_sums_.data() + family.first_step, TransposedRow(y) + family.first_step,
                       width_, family.steps, steps_, row_choices_[f].data()});
    }
    for (int x = 0; x < width_; ++x) choices_[Index(x, y)] = Best(x, y);
  }

  size_t Index(int x, int y) const { return static_cast<size_t>(y) * width_ + x; }

  Choice Best(int x, int y) const {
    Choice best;
    best.at = row_choices_[0][x];
    int mean = best.at.mean * families_[0].steps;
    for (size_t f = 1; f < families_.size(); ++f) {
      const StepChoice& other = row_choices_[f][x];
      mean += other.mean * families_[f].steps;
      if (other.least >= best.at.least) continue;
      best.family = static_cast<uint8_t>(f);
      best.at = other;
    }
    best.mean = static_cast<float>(mean) / static_cast<float>(16 * steps_);
    best.second = Second(x, y, best);
    return best;
  }

  // Another family's best step may be the same depth.
  uint16_t Second(int x, int y, const Choice& best) const {
    uint16_t second = best.at.second;
    for (size_t f = 0; f < families_.size(); ++f) {
      if (f == best.family) continue;
      const StepChoice& other = row_choices_[f][x];
      const bool is_same = StepsBetween(x, y, best, f) <= kSameDepthSteps;
      second = std::min(second, is_same ? other.second : other.least);
    }
    return second;
  }

  double StepsBetween(int x, int y, const Choice& best, size_t other) const {
    const Family &mine = families_[best.family], &theirs = families_[other];
    const Eigen::Vector2d ray = photo_->camera.Ray({x + 0.5, y + 0.5});
    const double difference = mine.InverseDepth(ray, best.at.step) -
                              theirs.InverseDepth(ray, row_choices_[other][x].step);
    return std::abs(difference) / std::max(mine.step_size, theirs.step_size);
  }

  // ---- Depths ----

  // Sub-step by two lines of equal slope (Shimizu and Okutomi 2001): costs of census rise linearly.
  static double SubStep(const StepChoice& choice) {
    const double low = choice.before - choice.least, high = choice.after - choice.least;
    const double rise = std::max(low, high);
    return rise > 0 ? (low - high) / (2 * rise) : 0;
  }

  // Part of the mean cost by which the cost at the chosen step is lower, around each pixel.
  cv::Mat1f Evidence() const {
    cv::Mat1f gain(height_, width_);
    for (int y = 0; y < height_; ++y) {
      for (int x = 0; x < width_; ++x) {
        const Choice& choice = choices_[Index(x, y)];
        gain(y, x) = static_cast<float>(choice.mean - choice.at.cost);
      }
    }
    cv::boxFilter(gain, gain, -1, cv::Size(kEvidenceWindow, kEvidenceWindow));
    return gain / static_cast<double>(num_views_ * kCensusBits) * 2;
  }

  bool IsFound(const Choice& choice, float evidence) const {
    const int last = families_[choice.family].steps - 1;
    if (choice.at.step == 0 || choice.at.step == last) return false;  // truth may lie beyond
    if (evidence < kMinEvidence) return false;
    return choice.second > (1 + kMinUniqueness) * choice.at.least;
  }

  // Step and sub-step of each pixel, -1 at holes.
  cv::Mat1f FoundSteps(const cv::Mat1f& evidence) const {
    cv::Mat1f found(height_, width_, -1.0f);
    for (int y = 0; y < height_; ++y) {
      for (int x = 0; x < width_; ++x) {
        const Choice& choice = choices_[Index(x, y)];
        if (!photo_->valid.empty() && photo_->valid(y, x) == 0) continue;
        if (!IsFound(choice, evidence(y, x))) continue;
        found(y, x) = static_cast<float>(choice.at.step + SubStep(choice.at));
      }
    }
    return found;
  }

  // Mean over the pixels around of the same family that are at most a step away: an edge stays
  // where it is.
  float MeanAround(const cv::Mat1f& steps, int x, int y) const {
    const float middle = steps(y, x);
    const int family = choices_[Index(x, y)].family;
    float sum = 0, count = 0;
    for (int v = std::max(0, y - 1); v <= std::min(y + 1, steps.rows - 1); ++v) {
      for (int u = std::max(0, x - 1); u <= std::min(x + 1, steps.cols - 1); ++u) {
        if (std::abs(steps(v, u) - middle) > 1 || steps(v, u) < 0) continue;
        if (choices_[Index(u, v)].family != family) continue;
        sum += steps(v, u);
        count += 1;
      }
    }
    return sum / count;
  }

  void FillMap(DepthMap* map) {
    const PartTimer timer(&times_.choice);
    const cv::Mat1f evidence = Evidence(), steps = FoundSteps(evidence);
    for (int y = 0; y < height_; ++y) {
      for (int x = 0; x < width_; ++x) {
        if (steps(y, x) < 0) continue;
        const Family& family = families_[choices_[Index(x, y)].family];
        const double step = MeanAround(steps, x, y);
        const Eigen::Vector2d ray = photo_->camera.Ray({x + 0.5, y + 0.5});
        const double inverse = family.InverseDepth(ray, step);
        const double parallax = family.Parallax(ray, step);
        if (!(parallax > 0 && inverse > 0)) continue;
        const double less = kMinEvidence / evidence(y, x);
        const double of_match = kMatchErrorPx * std::sqrt(less * std::sqrt(less)) / parallax;
        const double of_step = kSubStepError * family.step_size;
        const double error = std::sqrt(of_match * of_match + of_step * of_step);
        map->depth(y, x) = static_cast<float>(1 / inverse);
        map->error(y, x) = static_cast<float>(error / (inverse * inverse));
      }
    }
  }

  struct PathState {
    std::vector<uint8_t> costs[3], least[3];
  };

  static constexpr double kSameDepthSteps = 2.5;  // by which one depth differs in two families
  static constexpr double kMinSearchPx = 4;  // less parallax over the whole range tells nothing

  const SweepKernels& kernels_;
  DepthTimes times_;
  std::vector<Eigen::Vector3d> given_;
  const DepthPhoto* photo_ = nullptr;
  int width_ = 0, height_ = 0, stride_ = 0, min_steps_ = 0, steps_ = 0;
  std::vector<Family> families_;
  int num_views_ = 0;  // of each family
  PaddedRows reference_, warped_, warp_scratch_;
  std::vector<uint8_t> costs_, census_scratch_, path_scratch_;
  std::vector<uint16_t> sums_, row_sums_;  // of the paths down; of all paths
  PathState states_[2];
  uint8_t penalties_[256] = {};
  std::vector<StepChoice> row_choices_[kMaxSweepSteps / kSweepLanes];  // of each family
  std::vector<Choice> choices_;
};

DepthSweep::DepthSweep(InstructionSet kernel) {
  if (!IsInstructionSetSupported(kernel)) {
    throw std::invalid_argument("this processor does not run kernel " + InstructionSetName(kernel));
  }
  workspace_ = std::make_unique<Workspace>(kernel);
}
DepthSweep::~DepthSweep() = default;
DepthSweep::DepthSweep(DepthSweep&& other) noexcept = default;

const DepthTimes& DepthSweep::times() const { return workspace_->times(); }
int DepthSweep::steps() const { return workspace_->steps(); }

std::optional<DepthMap> DepthSweep::Estimate(const DepthPhoto& photo,
                                             const std::vector<const DepthPhoto*>& neighbours,
                                             const DepthRange& range, const DepthStop& stop) {
  CheckInput(photo, neighbours, range);
  workspace_->Reset(range.planes);
  auto map = workspace_->Run(photo, neighbours, {1 / range.far, 1 / range.near}, stop);
  if (map) RemoveDepthsOfBareAreas(photo.grey, &*map);
  return map;
}

}  // namespace skein
