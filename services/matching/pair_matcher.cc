#include "matching/pair_matcher.h"

#include <algorithm>
#include <utility>

#include "core/clock.h"

namespace skein {
namespace {

// Below this the full product costs little more than what spares it.
constexpr size_t kMinFeatures = 4 * kMaxCoarse;

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

// The surest first.
FeatureMatches ToMatches(std::vector<IndexPair> pairs) {
  std::stable_sort(pairs.begin(), pairs.end(),
                   [](const IndexPair& a, const IndexPair& b) { return a.ratio_sq < b.ratio_sq; });
  FeatureMatches matches;
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

void SortByFirst(FeatureMatches* matches) {
  std::sort(matches->begin(), matches->end(),
            [](const auto& a, const auto& b) { return a.point2D_idx1 < b.point2D_idx1; });
}

MatchOptions OfKernel(KernelVersion kernel) {
  MatchOptions options;
  options.kernel = kernel;
  return options;
}

}  // namespace

uint32_t PairSeed(int64_t image_id, int64_t other_id) {
  // The finaliser of SplitMix64.
  uint64_t x = static_cast<uint64_t>(image_id) << 32 ^ static_cast<uint64_t>(other_id);
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return static_cast<uint32_t>(x ^ (x >> 31));
}

PairMatcher::PairMatcher(bool cascade, KernelVersion kernel)
    : cascade_(cascade), matcher_(OfKernel(kernel)) {}

void PairMatcher::Verify(const PhotoFeatures& first, const PhotoFeatures& second,
                         const FeatureMatches& matches, PairResult* result) const {
  const Stopwatch watch(&result->geometry_s);
  PairEstimate estimate =
      EstimateWithoutOverlay(first, second, matches, PairSeed(first.image_id, second.image_id));
  result->geometry = std::move(estimate.geometry);
  result->evidence = std::move(estimate.evidence);
}

void PairMatcher::MatchInFull(const PhotoFeatures& first, const PhotoFeatures& second,
                              PairResult* result) {
  FeatureMatches matches;
  {
    const Stopwatch watch(&result->product_s);
    matches = ToMatches(matcher_.Match(DescriptorsOf(first), DescriptorsOf(second)));
  }
  Verify(first, second, matches, result);
}

FeatureMatches PairMatcher::MatchByCells(const PhotoFeatures& first, const PhotoFeatures& second,
                                         const CellLists& others, PairResult* result) {
  const Stopwatch watch(&result->product_s);
  return ToMatches(matcher_.MatchParts(DescriptorsOf(first), DescriptorsOf(second),
                                       PartsOf(first.index.cells.home, others)));
}

FeatureMatches PairMatcher::MatchCoarsest(const PhotoFeatures& first, const PhotoFeatures& second) {
  FeatureMatches matches = ToMatches(matcher_.Match(CoarsestOf(first), CoarsestOf(second)));
  for (FeatureMatch& match : matches) {
    match.point2D_idx1 = first.index.coarsest[match.point2D_idx1];
    match.point2D_idx2 = second.index.coarsest[match.point2D_idx2];
  }
  return matches;
}

int PairMatcher::CountCoarseMatches(const PhotoFeatures& first, const PhotoFeatures& second) {
  return static_cast<int>(matcher_.Match(CoarsestOf(first), CoarsestOf(second)).size());
}

bool PairMatcher::LookFirst(const PhotoFeatures& first, const PhotoFeatures& second,
                            PairResult* result) {
  FeatureMatches matches;
  {
    const Stopwatch watch(&result->product_s);
    matches = MatchCoarsest(first, second);
  }
  const Stopwatch watch(&result->geometry_s);
  return HaveGeometry(first.camera, first.points, second.camera, second.points, matches,
                      PairSeed(first.image_id, second.image_id));
}

bool PairMatcher::MatchByCloseCells(const PhotoFeatures& first, const PhotoFeatures& second,
                                    PairResult* result) {
  const FeatureMatches matches = MatchByCells(first, second, second.index.cells.close, result);
  Verify(first, second, matches, result);
  return IsVerified(result->geometry) &&
         2 * result->geometry.inlier_matches.size() >= matches.size();
}

PairResult PairMatcher::Match(const PhotoFeatures& first, const PhotoFeatures& second) {
  PairResult result;
  if (!cascade_ || !CanCascade(first) || !CanCascade(second)) {
    MatchInFull(first, second, &result);
  } else if (LookFirst(first, second, &result) && MatchByCloseCells(first, second, &result)) {
    result.by_close_cells = true;
  } else {
    Verify(first, second, MatchByCells(first, second, second.index.cells.near, &result), &result);
  }
  SortByFirst(&result.geometry.inlier_matches);
  result.stand_still = StandStill(first, second, result.geometry.inlier_matches);
  return result;
}

}  // namespace skein
