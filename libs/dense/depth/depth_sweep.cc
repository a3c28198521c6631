#include "depth/depth_sweep.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "core/clock.h"
#include "core/statistics.h"
#include "depth/depth_regions.h"
#include "depth/padded_rows.h"
#include "depth/warped_view.h"

namespace skein {
namespace {

constexpr int kCensusThreshold = 2;  // grey levels
constexpr int kTruncation = 6;       // of kCensusBits, of a neighbour's cost above the best one's
// Penalties of a path, of a neighbour: of a change of depth by one step, and of a larger one.
constexpr int kSmallPenalty = 5, kLargePenalty = 22;
static_assert(kTruncation + kSmallPenalty + kLargePenalty <=
              kMaxPathCost / kMaxSweepViews - kCensusBits);
// A depth is a hole unless the sum of the paths' costs two steps away or more is this share higher,
// and the cost at its step is this share below the mean over all steps around it.
constexpr double kMinUniqueness = 0.02, kMinEvidence = 0.12;

constexpr int kStopRows = 16;  // rows between two questions whether to stop
constexpr int kEvidenceWindow = 5;
constexpr int kRegionMarginPx = 8;  // around a region, where paths begin
// Standard errors: of a match with the least evidence that is kept, and of a sub-step (measured:
// docs/experiments/depth.md).
constexpr double kMatchErrorPx = 0.7;
constexpr double kEvidencePower = 0.75;  // by which more evidence makes it less
constexpr double kSubStepError = 0.3;    // of a step

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

bool HasSize(const cv::Mat& pixels, const DepthCamera& camera) {
  return pixels.cols == camera.width && pixels.rows == camera.height;
}

bool IsSound(const DepthPhoto& photo) {
  const DepthCamera& camera = photo.camera;
  return camera.width > 0 && camera.height > 0 && HasSize(photo.grey, camera) &&
         (photo.valid.empty() || HasSize(photo.valid, camera)) && camera.focal_px.minCoeff() > 0 &&
         camera.focal_px.allFinite() && camera.principal_point_px.allFinite() &&
         photo.cam_from_world.rotation.allFinite() && photo.cam_from_world.translation.allFinite();
}

void CheckInput(const DepthPhoto& photo, const std::vector<const DepthPhoto*>& neighbours,
                const DepthRange& range) {
  if (!(range.near > 0 && range.near < range.far && std::isfinite(range.far))) {
    throw std::invalid_argument("depth map: give depths 0 < near < far");
  }
  const bool sound = IsSound(photo) && std::all_of(neighbours.begin(), neighbours.end(),
                                                   [](const auto* n) { return IsSound(*n); });
  if (!sound) {
    throw std::invalid_argument("depth map: pixels, camera and pose of a photo do not fit");
  }
}

}  // namespace

int64_t DepthSweepBytes(int width, int height, int steps, int neighbours) {
  const int64_t pixels = int64_t{RoundUp(width, 64)} * height;
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
    if (is_small || LongestSearchPx(photo, neighbours, planes) <= kMaxSweepSteps) {
      return Sweep(photo, neighbours, planes, kMinSweepSteps, stop);
    }
    const std::optional<DepthMap> coarse = RunHalved(photo, neighbours, planes, stop);
    if (!coarse) return std::nullopt;
    return SweepRegions(photo, neighbours, planes, *coarse, stop);
  }

  void ResetTimes() { times_ = {}; }
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
    const auto search_px = [&](const DepthRegion& region) {
      return LongestSearchPx(Cropped(photo, region.area), neighbours, region.planes);
    };
    for (const DepthRegion& region : RegionsOf(photo, coarse, planes, kMaxSweepSteps, search_px)) {
      const cv::Rect around = Around(region.area) & cv::Rect(cv::Point(), map.depth.size());
      const DepthPhoto part = Cropped(photo, around);
      const auto found = Sweep(part, neighbours, region.planes, kSweepLanes, stop);
      if (!found) return std::nullopt;
      const cv::Rect inside(region.area.tl() - around.tl(), region.area.size());
      found->depth(inside).copyTo(map.depth(region.area));
      found->error(inside).copyTo(map.error(region.area));
    }
    const cv::Mat1b is_beyond = (map.depth < 1 / planes.last) | (map.depth > 1 / planes.first);
    map.depth.setTo(0, is_beyond);
    map.error.setTo(0, is_beyond);
    return map;
  }

  static cv::Rect Around(const cv::Rect& area) {
    return {area.x - kRegionMarginPx, area.y - kRegionMarginPx, area.width + 2 * kRegionMarginPx,
            area.height + 2 * kRegionMarginPx};
  }

  // ---- One sweep ----

  std::optional<DepthMap> Sweep(const DepthPhoto& photo,
                                const std::vector<const DepthPhoto*>& neighbours,
                                const SweepPlanes& planes, int min_steps, const DepthStop& stop) {
    photo_ = &photo;
    min_steps_ = min_steps;
    width_ = photo.camera.width;
    height_ = photo.camera.height;
    planes_ = planes;
    MakeViews(neighbours);
    DepthMap map = HolesOf(photo);
    if (views_.empty()) return map;
    const bool is_done = SumCosts(stop) && AddPaths(1, stop) && AddPaths(-1, stop);
    if (!is_done) return std::nullopt;
    FillMap(&map);
    return map;
  }

  double PlaneOf(double step) const { return planes_.first + step * step_size_; }

  static DepthMap HolesOf(const DepthPhoto& photo) {
    const cv::Size size = photo.grey.size();
    return {photo.camera, photo.cam_from_world, cv::Mat1f(size, 0.0f), cv::Mat1f(size, 0.0f)};
  }

  void MakeViews(const std::vector<const DepthPhoto*>& neighbours) {
    const PartTimer timer(&times_.warp);
    views_.clear();
    double longest = 0;
    for (const DepthPhoto* neighbour : neighbours) {
      if (views_.size() == kMaxSweepViews) break;
      WarpedView view(*photo_, *neighbour, planes_);
      const double length = view.SearchLengthPx();
      if (length < kMinSearchPx) continue;
      longest = std::max(longest, length);
      views_.push_back(std::move(view));
    }
    const double wanted = std::min<double>(longest, kMaxSweepSteps) + 1;
    steps_ = RoundUp(std::max(static_cast<int>(wanted), min_steps_), kSweepLanes);
    steps_ = std::min(steps_, kMaxSweepSteps / kSweepLanes * kSweepLanes);
    step_size_ = (planes_.last - planes_.first) / (steps_ - 1);
  }

  // ---- Costs: of each plane, [step][row][column] ----

  bool SumCosts(const DepthStop& stop) {
    stride_ = RoundUp(width_, 64);
    costs_.resize(static_cast<size_t>(stride_) * height_ * steps_ + kSweepMargin);
    PadReference();
    for (int step = 0; step < steps_; ++step) {
      if (stop && stop()) return false;
      SumCostsOf(step);
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
    return costs_.data() + (static_cast<size_t>(step) * height_ + y) * stride_;
  }

  void SumCostsOf(int step) {
    const PartTimer timer(&times_.costs);
    const int num_views = static_cast<int>(views_.size());
    warped_.Resize(width_ + 2 * kWarpBorder + 2 * kSweepMargin, num_views * kCensusRows);
    int widest = 0;
    for (WarpedView& view : views_) {
      view.SetPlane(PlaneOf(step));
      widest = std::max(widest, view.source_width());
    }
    warp_scratch_.resize(widest + 2 * kSweepMargin + kSweepLanes);
    census_scratch_.resize(static_cast<size_t>(num_views) * (width_ + kSweepMargin) + kSweepMargin);
    for (int y = -kCensusRadius; y < height_ + kCensusRadius; ++y) {
      for (int i = 0; i < num_views; ++i) WarpRowOf(i, y);
      if (y >= kCensusRadius) CensusRowOf(step, y - kCensusRadius);
    }
  }

  // Rows of the warped neighbours are kept in a ring.
  uint8_t* WarpedRow(int view, int y) {
    return warped_.Row(view * kCensusRows + (y + kCensusRows) % kCensusRows) + kWarpBorder;
  }

  void WarpRowOf(int i, int y) {
    if (!views_[i].IsSeen()) return;
    WarpTask task = {};
    views_[i].FillRow(y, &task);
    task.scratch = warp_scratch_.data();
    task.out = WarpedRow(i, y) - kWarpBorder;
    kernels_.warp(task);
  }

  void CensusRowOf(int step, int y) {
    CensusTask task = {};
    task.num_views = static_cast<int>(views_.size());
    for (int k = 0; k < kCensusRows; ++k) {
      task.reference[k] = reference_.Row(y + k);
      for (int i = 0; i < task.num_views; ++i) {
        task.views[i][k] = WarpedRow(i, y + k - kCensusRadius);
      }
    }
    for (int i = 0; i < task.num_views; ++i) views_[i].Range(y, &task.first[i], &task.last[i]);
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
    row_costs_.resize(static_cast<size_t>(RoundUp(width_, kSweepLanes)) * steps_);
    SetPenalties();
    choices_.resize(static_cast<size_t>(width_) * height_);
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

  int NumViews() const { return static_cast<int>(views_.size()); }
  int SmallPenalty() const { return kSmallPenalty * NumViews(); }

  // Less where the photo has an edge: depth may have one, too.
  void SetPenalties() {
    for (int difference = 0; difference < 256; ++difference) {
      const int large = kLargePenalty * NumViews() * 16 / (16 + difference);
      penalties_[difference] = static_cast<uint8_t>(std::max(large, SmallPenalty() + 1));
    }
  }

  void TransposeRow(int y) {
    const uint8_t* rows[kMaxSweepSteps];
    for (int step = 0; step < steps_; ++step) rows[step] = CostRow(step, y);
    kernels_.transpose({rows, width_, steps_, row_costs_.data()});
  }

  void AddPathsOfRow(int y, bool is_first, int direction) {
    const PartTimer timer(&times_.paths);
    TransposeRow(y);
    PathTask task = {};
    task.cost = row_costs_.data();
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
    task.adds = direction < 0;
    task.sum = SumRow(y);
    kernels_.paths(task);
    std::swap(states_[0], states_[1]);
  }

  uint16_t* SumRow(int y) { return sums_.data() + static_cast<size_t>(y) * width_ * steps_; }

  void ChooseRow(int y) {
    const PartTimer timer(&times_.choice);
    kernels_.choose({SumRow(y), row_costs_.data(), width_, steps_,
                     choices_.data() + static_cast<size_t>(y) * width_});
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
    cv::Mat1f gain(height_, width_), mean(height_, width_);
    for (int y = 0; y < height_; ++y) {
      for (int x = 0; x < width_; ++x) {
        const StepChoice& choice = choices_[static_cast<size_t>(y) * width_ + x];
        mean(y, x) = static_cast<float>(choice.mean) / 16;
        gain(y, x) = mean(y, x) - static_cast<float>(choice.cost);
      }
    }
    const cv::Size window(kEvidenceWindow, kEvidenceWindow);
    cv::boxFilter(gain, gain, -1, window);
    return gain / static_cast<double>(NumViews() * kCensusBits) * 2;
  }

  bool IsFound(const StepChoice& choice, float evidence) const {
    if (choice.step == 0 || choice.step + 1 >= steps_) return false;  // truth may lie beyond
    if (evidence < kMinEvidence) return false;
    return choice.second > (1 + kMinUniqueness) * choice.least;
  }

  // By which all neighbours move for a unit of inverse depth, taken together.
  double Parallax(const Eigen::Vector2d& ray, double plane) const {
    double sum = 0;
    for (const WarpedView& view : views_) {
      const double one = view.Parallax(ray, plane);
      sum += one * one;
    }
    return std::sqrt(sum);
  }

  // Step and sub-step of each pixel, -1 at holes.
  cv::Mat1f FoundSteps(const cv::Mat1f& evidence) const {
    cv::Mat1f found(height_, width_, -1.0f);
    for (int y = 0; y < height_; ++y) {
      for (int x = 0; x < width_; ++x) {
        const StepChoice& choice = choices_[static_cast<size_t>(y) * width_ + x];
        if (!photo_->valid.empty() && photo_->valid(y, x) == 0) continue;
        if (!IsFound(choice, evidence(y, x))) continue;
        found(y, x) = static_cast<float>(choice.step + SubStep(choice));
      }
    }
    return found;
  }

  // Mean over the pixels around that are at most a step away: an edge stays where it is.
  static float MeanAround(const cv::Mat1f& steps, int x, int y) {
    const float middle = steps(y, x);
    float sum = 0, count = 0;
    for (int v = std::max(0, y - 1); v <= std::min(y + 1, steps.rows - 1); ++v) {
      for (int u = std::max(0, x - 1); u <= std::min(x + 1, steps.cols - 1); ++u) {
        if (std::abs(steps(v, u) - middle) > 1 || steps(v, u) < 0) continue;
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
        const double plane = PlaneOf(MeanAround(steps, x, y));
        const Eigen::Vector2d ray = photo_->camera.Ray({x + 0.5, y + 0.5});
        const double inverse = planes_.InverseDepth(ray, plane);
        const double parallax = Parallax(ray, plane);
        if (!(parallax > 0 && inverse > 0)) continue;
        const double of_match =
            kMatchErrorPx * std::pow(kMinEvidence / evidence(y, x), kEvidencePower) / parallax;
        const double error = std::hypot(of_match, kSubStepError * step_size_);
        map->depth(y, x) = static_cast<float>(1 / inverse);
        map->error(y, x) = static_cast<float>(error / (inverse * inverse));
      }
    }
  }

  struct PathState {
    std::vector<uint8_t> costs[3], least[3];
  };

  static constexpr double kMinSearchPx = 4;  // less parallax over the whole range tells nothing

  const SweepKernels& kernels_;
  DepthTimes times_;
  const DepthPhoto* photo_ = nullptr;
  int width_ = 0, height_ = 0, stride_ = 0, min_steps_ = 0, steps_ = 0;
  SweepPlanes planes_;
  double step_size_ = 0;
  std::vector<WarpedView> views_;
  PaddedRows reference_, warped_;
  std::vector<uint8_t> costs_, warp_scratch_, census_scratch_, path_scratch_, row_costs_;
  std::vector<uint16_t> sums_;
  PathState states_[2];
  uint8_t penalties_[256] = {};
  std::vector<StepChoice> choices_;
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
  workspace_->ResetTimes();
  return workspace_->Run(photo, neighbours, {1 / range.far, 1 / range.near}, stop);
}

double DepthMap::Completeness() const {
  return depth.empty() ? 0 : static_cast<double>(cv::countNonZero(depth)) / depth.total();
}

double DepthMap::MedianDepth() const {
  std::vector<double> depths;
  std::copy_if(depth.begin(), depth.end(), std::back_inserter(depths),
               [](float one) { return one > 0; });
  return UpperMedian(std::move(depths));
}

}  // namespace skein
