#include "features/own_sift.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

#include "features/keypoint_selection.h"
#include "features/parallel_for.h"
#include "features/usual_contrast.h"

namespace skein {
namespace {

constexpr float kPeakShare =
    0.8f;                          // of the highest peak: further directions (Lowe 2004, section 5)
constexpr float kMaxShare = 0.2f;  // of a descriptor's length in one value (section 6.1)

// With fewer a photo is searched deeper. It is a quarter of the features that a photo may have;
// sets with fewer gain by more (docs/experiments/features.md).
constexpr size_t kEnoughExtrema = 2048;
// Contrast that rounding to 8 bits makes: a standard deviation of 0.29 grey levels, of which the
// first difference of Gaussians leaves 0.053, times its layers.
constexpr double kRounding = 0.00063;
// In standard deviations. Noise reaches the second nowhere in a photo, and the first rarely.
constexpr double kLeastContrast = 4 * kRounding;
constexpr double kSalientDeviations = 5;
// As many as a photo has whose diagnosis is not "few details" (session/diagnosis.h). In noise that
// a JPEG's coder has made coarser up to 67 were counted.
constexpr ptrdiff_t kMinSalient = 300;

// Photo pixels of an octave's pixel; octave 0 is the doubled photo.
float PixelSize(const Extremum& extremum) { return std::ldexp(0.5f, extremum.octave); }

// OpenCV's smoothing and peaks, radians.
std::vector<float> PeakAngles(const float* histogram) {
  constexpr int n = kOrientationBins;
  float smooth[n];
  for (int i = 0; i < n; ++i) {
    const auto at = [&](int k) { return histogram[(i + k + n) % n]; };
    smooth[i] = (at(-2) + at(2) + 4 * (at(-1) + at(1)) + 6 * at(0)) / 16;
  }
  const float least = kPeakShare * *std::max_element(smooth, smooth + n);
  std::vector<float> angles;
  for (int i = 0; i < n; ++i) {
    const float before = smooth[(i + n - 1) % n], here = smooth[i], after = smooth[(i + 1) % n];
    if (here <= before || here <= after || here < least) continue;
    const float bin = i + 0.5f * (before - after) / (before - 2 * here + after);
    const float turn = (bin < 0 ? bin + n : bin >= n ? bin - n : bin) / n;
    angles.push_back(static_cast<float>(2 * CV_PI) * turn);
  }
  return angles;
}

// Values above 0.2 of the length are cut, then RootSIFT.
void Finish(const float* gradients, uint8_t* out) {
  constexpr int n = Descriptors::kDim;
  float squares = 0;
  for (int i = 0; i < n; ++i) squares += gradients[i] * gradients[i];
  const float most = kMaxShare * std::sqrt(squares);
  float cut[n], sum = 0;
  for (int i = 0; i < n; ++i) sum += cut[i] = std::min(gradients[i], most);
  RootSift(cut, sum, out);
}

// Indices by place in memory, so that neighbours share cache lines.
template <typename T, typename Get>
std::vector<int> ByPlace(const std::vector<T>& all, const Get& get) {
  std::vector<int> order(all.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int a, int b) {
    const Extremum &p = get(all[a]), &q = get(all[b]);
    return std::tie(p.octave, p.level, p.y) < std::tie(q.octave, q.level, q.y);
  });
  return order;
}

}  // namespace

OwnSift::OwnSift(const SiftOptions& options)
    : options_(options), kernels_(KernelsOf(options.kernel)), scale_space_(kernels_) {}

template <typename T, typename Get>
std::vector<T> OwnSift::Strongest(const std::vector<T>& all, cv::Size size, const Get& get) const {
  std::vector<cv::KeyPoint> keypoints;
  keypoints.reserve(all.size());
  for (const T& one : all) {
    const Extremum& extremum = get(one);
    const float pixel = PixelSize(extremum);
    keypoints.emplace_back(pixel * extremum.x, pixel * extremum.y, 2 * pixel * extremum.sigma, 0.f,
                           extremum.contrast);
  }
  std::vector<T> kept;
  for (const int i : SelectKeypoints(keypoints, size, options_.max_features))
    kept.push_back(all[i]);
  return kept;
}

std::vector<OwnSift::Oriented> OwnSift::Orient(const std::vector<Extremum>& extrema,
                                               int threads) const {
  const auto order = ByPlace(extrema, [](const Extremum& e) -> const Extremum& { return e; });
  std::vector<std::vector<float>> angles(extrema.size());
  ParallelFor(static_cast<int>(order.size()), threads, [&](const cv::Range& range) {
    for (int i = range.start; i < range.end; ++i) {
      float histogram[kOrientationBins];
      kernels_.orientations(scale_space_.Patch(extrema[order[i]], 0), histogram);
      angles[order[i]] = PeakAngles(histogram);
    }
  });
  std::vector<Oriented> oriented;
  for (size_t i = 0; i < extrema.size(); ++i) {
    for (const float angle : angles[i]) oriented.push_back({extrema[i], angle});
  }
  return oriented;
}

// A photo of low contrast, as in fog or under water, has few extrema above a threshold that is made
// for others. It is searched once more, as deep as 8 bits allow. A photo of nothing has few as
// well, and deeper there is only noise: of that one no more is taken than what stands out of it.
std::vector<Extremum> OwnSift::FindExtrema(const cv::Mat& grey, int threads) {
  std::vector<Extremum> extrema = scale_space_.Build(grey, kContrastThreshold, threads);
  const size_t enough = std::min(kEnoughExtrema, static_cast<size_t>(options_.max_features));
  if (extrema.size() >= enough) return extrema;
  const double salient =
      std::min(kContrastThreshold, kSalientDeviations * std::max(kRounding, UsualContrast(grey)));
  const auto is_salient = [salient](const Extremum& extremum) {
    return kOctaveLayers * extremum.contrast >= salient;
  };
  extrema = scale_space_.Build(grey, kLeastContrast, threads);
  const auto end = std::stable_partition(extrema.begin(), extrema.end(), is_salient);
  if (end - extrema.begin() < kMinSalient) extrema.erase(end, extrema.end());
  return extrema;
}

LocalFeatures OwnSift::Extract(const cv::Mat& grey, int threads) {
  // As many extrema as features are wanted have at least so many directions.
  const auto extrema = Strongest(FindExtrema(grey, threads), grey.size(),
                                 [](const Extremum& e) -> const Extremum& { return e; });
  const auto get = [](const Oriented& o) -> const Extremum& { return o.extremum; };
  const auto kept = Strongest(Orient(extrema, threads), grey.size(), get);

  LocalFeatures features;
  features.keypoints.reserve(kept.size());
  for (const Oriented& of : kept) {
    const float pixel = PixelSize(of.extremum);
    Keypoint keypoint;
    keypoint.x = pixel * of.extremum.x + 0.5f;
    keypoint.y = pixel * of.extremum.y + 0.5f;
    keypoint.scale_px = pixel * of.extremum.sigma;
    keypoint.angle_rad = of.angle_rad;
    features.keypoints.push_back(keypoint);
  }
  features.descriptors.data.resize(kept.size() * Descriptors::kDim);
  const auto order = ByPlace(kept, get);
  ParallelFor(static_cast<int>(kept.size()), threads, [&](const cv::Range& range) {
    for (int i = range.start; i < range.end; ++i) {
      const int at = order[i];
      float gradients[Descriptors::kDim];
      kernels_.describe(scale_space_.Patch(kept[at].extremum, kept[at].angle_rad), gradients);
      Finish(gradients, features.descriptors.data.data() + at * Descriptors::kDim);
    }
  });
  return features;
}

}  // namespace skein
