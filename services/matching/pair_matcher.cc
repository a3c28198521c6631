#include "matching/pair_matcher.h"

#include <algorithm>
#include <utility>

#include "core/clock.h"
#include "core/option_check.h"

namespace skein {
namespace {

// Below this the full product costs little more than what spares it.
constexpr size_t kMinFeatures = 4 * kMaxCoarse;

// Pairs with fewer guided inliers are matched by cells: more of these matches are false.
constexpr size_t kMinGuidedInliers = 200;

// The band of guided matching, of the largest error of an inlier: a wider one finds no more
// matches, as the ratio test has more neighbours to compare with.
constexpr double kGuidedErrorShare = 0.75;

DescriptorView DescriptorsOf(const PhotoFeatures& photo) {
  return {photo.descriptors.data(), static_cast<int>(photo.points.size()),
          photo.index.norm_sq.data()};
}

DescriptorView CoarsestOf(const PhotoFeatures& photo) {
  return {photo.index.coarse_descriptors.data(), static_cast<int>(photo.index.coarsest.size())};
}

bool CanCascade(const PhotoFeatures& photo) {
  return photo.points.size() >= kMinFeatures && photo.index.coarsest.size() == kMaxCoarse &&
         !photo.index.cells.empty();
}

colmap::FeatureMatches ToColmap(const std::vector<IndexPair>& pairs) {
  colmap::FeatureMatches matches;
  matches.reserve(pairs.size());
  for (const IndexPair& pair : pairs) matches.emplace_back(pair.first, pair.second);
  return matches;
}

class Stopwatch {
 public:
  explicit Stopwatch(double* seconds) : seconds_(seconds) {}
  ~Stopwatch() { *seconds_ += timer_.ElapsedS(); }

 private:
  double* seconds_;
  Timer timer_;
};

GuidedOptions GuidedOptionsOf(const PairMatcherOptions& options) {
  GuidedOptions guided;
  guided.max_error_px = kGuidedErrorShare * options.two_view.max_error_px;
  guided.max_distance_sq = options.matching.max_distance_sq;
  guided.kernel = options.matching.kernel;
  return guided;
}

}  // namespace

uint32_t PairSeed(int64_t image_id, int64_t other_id) {
  // The finaliser of SplitMix64.
  uint64_t x = static_cast<uint64_t>(image_id) << 32 ^ static_cast<uint64_t>(other_id);
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return static_cast<uint32_t>(x ^ (x >> 31));
}

Status PairMatcherOptions::Check() const {
  return FirstError({matching.Check(), two_view.Check()});
}

PairMatcher::PairMatcher(const PairMatcherOptions& options)
    : options_(options), matcher_(options.matching), guided_(GuidedOptionsOf(options)) {
  ThrowUnlessSound(options.Check());
}

void PairMatcher::Verify(const PhotoFeatures& first, const PhotoFeatures& second,
                         const colmap::FeatureMatches& matches, PairResult* result) const {
  const Stopwatch watch(&result->geometry_s);
  PairEstimate estimate = EstimateWithoutOverlay(
      first, second, matches, PairSeed(first.image_id, second.image_id), options_.two_view);
  result->geometry = std::move(estimate.geometry);
  result->evidence = std::move(estimate.evidence);
}

void PairMatcher::MatchAll(const PhotoFeatures& first, const PhotoFeatures& second, bool by_cells,
                           PairResult* result) {
  colmap::FeatureMatches matches;
  {
    const Stopwatch watch(&result->product_s);
    const DescriptorView a = DescriptorsOf(first), b = DescriptorsOf(second);
    matches = ToColmap(
        by_cells ? matcher_.MatchParts(a, b, PartsOf(first.index.cells, second.index.cells))
                 : matcher_.Match(a, b));
  }
  Verify(first, second, matches, result);
}

colmap::FeatureMatches PairMatcher::MatchCoarsest(const PhotoFeatures& first,
                                                  const PhotoFeatures& second) {
  colmap::FeatureMatches matches = ToColmap(matcher_.Match(CoarsestOf(first), CoarsestOf(second)));
  for (colmap::FeatureMatch& match : matches) {
    match.point2D_idx1 = first.index.coarsest[match.point2D_idx1];
    match.point2D_idx2 = second.index.coarsest[match.point2D_idx2];
  }
  return matches;
}

bool PairMatcher::LookFirst(const PhotoFeatures& first, const PhotoFeatures& second,
                            PairResult* result) {
  colmap::FeatureMatches matches;
  {
    const Stopwatch watch(&result->product_s);
    matches = MatchCoarsest(first, second);
  }
  Verify(first, second, matches, result);
  return IsVerified(result->geometry);
}

bool PairMatcher::MostStandStill(const PhotoFeatures& first, const PhotoFeatures& second,
                                 const colmap::TwoViewGeometry& geometry) const {
  const std::vector<char> still =
      StandStill(first, second, geometry.inlier_matches, options_.two_view.max_error_px);
  return 2 * std::count(still.begin(), still.end(), 1) > static_cast<ptrdiff_t>(still.size());
}

void PairMatcher::MatchGuided(const PhotoFeatures& first, const PhotoFeatures& second,
                              PairResult* result) {
  colmap::FeatureMatches matches;
  {
    const Stopwatch watch(&result->guided_s);
    matches = ToColmap(
        guided_.Match(first, second, EpipolarModel(first.camera, second.camera, result->geometry)));
  }
  LeaveOutOverlay(first, second, options_.two_view.max_error_px, &matches, &result->evidence);
  const Stopwatch watch(&result->geometry_s);
  result->geometry = RefineTwoView(first.camera, first.points, second.camera, second.points,
                                   matches, result->geometry, options_.two_view);
}

void PairMatcher::MatchByCascade(const PhotoFeatures& first, const PhotoFeatures& second,
                                 PairResult* result) {
  if (!options_.cascade || !CanCascade(first) || !CanCascade(second)) {
    MatchAll(first, second, false, result);
    return;
  }
  if (LookFirst(first, second, result) && !MostStandStill(first, second, result->geometry)) {
    MatchGuided(first, second, result);
    if (IsVerified(result->geometry) &&
        result->geometry.inlier_matches.size() >= kMinGuidedInliers) {
      return;
    }
  }
  MatchAll(first, second, true, result);
}

PairResult PairMatcher::Match(const PhotoFeatures& first, const PhotoFeatures& second) {
  PairResult result;
  MatchByCascade(first, second, &result);
  result.stand_still =
      StandStill(first, second, result.geometry.inlier_matches, options_.two_view.max_error_px);
  return result;
}

}  // namespace skein
