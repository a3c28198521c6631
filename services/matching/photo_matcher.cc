#include "matching/photo_matcher.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <iterator>
#include <thread>

#include "core/clock.h"
#include "core/option_check.h"

namespace skein {
namespace {

std::array<double, 9> RowMajor(const Eigen::Matrix3d& matrix) {
  std::array<double, 9> out;
  Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(out.data()) = matrix;
  return out;
}

TwoViewPair ToTwoViewPair(int64_t other_id, const colmap::TwoViewGeometry& geometry) {
  TwoViewPair pair;
  pair.other_id = other_id;
  pair.geometry = static_cast<int8_t>(geometry.config);
  pair.E = RowMajor(geometry.E);
  pair.F = RowMajor(geometry.F);
  pair.H = RowMajor(geometry.H);
  Eigen::Map<Eigen::Vector4d>(pair.qvec.data()) = geometry.qvec;
  Eigen::Map<Eigen::Vector3d>(pair.tvec.data()) = geometry.tvec;
  pair.tri_angle_rad = static_cast<float>(geometry.tri_angle);
  pair.forward_motion = static_cast<float>(ForwardMotion(geometry));
  for (const colmap::FeatureMatch& match : geometry.inlier_matches) {
    pair.inliers.emplace_back(match.point2D_idx1, match.point2D_idx2);
  }
  return pair;
}

void SortByInliers(TwoViewPairs* pairs) {
  std::stable_sort(pairs->begin(), pairs->end(), [](const TwoViewPair& a, const TwoViewPair& b) {
    return a.inliers.size() > b.inliers.size();
  });
}

// Runs work(thread, item) for all items on the calling thread and num_threads - 1 others. Rethrows
// what one of them throws.
template <typename Work>
void ParallelFor(int num_threads, int num_items, Work work) {
  std::atomic<int> next{0};
  std::vector<std::exception_ptr> errors(num_threads);
  const auto run = [&](int thread) {
    try {
      for (int item; (item = next++) < num_items;) work(thread, item);
    } catch (...) {
      errors[thread] = std::current_exception();
    }
  };
  std::vector<std::thread> threads;
  for (int i = 1; i < std::min(num_threads, num_items); ++i) threads.emplace_back(run, i);
  run(0);
  for (std::thread& thread : threads) thread.join();
  for (const std::exception_ptr& error : errors) {
    if (error) std::rethrow_exception(error);
  }
}

}  // namespace

void Append(PhotoMatches more, PhotoMatches* matches) {
  matches->num_tried += more.num_tried;
  matches->match_s += more.match_s;
  matches->verify_s += more.verify_s;
  matches->elapsed_s += more.elapsed_s;
  std::move(more.pairs.begin(), more.pairs.end(), std::back_inserter(matches->pairs));
  SortByInliers(&matches->pairs);
}

Status PhotoMatcherOptions::Check() const {
  return FirstError({pair.Check(), InRange("threads", num_threads, 1, 1024)});
}

PhotoMatcher::PhotoMatcher(const PhotoMatcherOptions& options) : options_(options) {
  ThrowUnlessSound(options.Check());
  for (int i = 0; i < options.num_threads; ++i) matchers_.emplace_back(options.pair);
}

PhotoMatches PhotoMatcher::Match(const PhotoFeatures& photo,
                                 const std::vector<PhotoFeaturesPtr>& others) {
  const Timer timer;
  std::vector<PairResult> results(others.size());
  ParallelFor(options_.num_threads, static_cast<int>(others.size()),
              [&](int thread, int i) { results[i] = matchers_[thread].Match(photo, *others[i]); });
  PhotoMatches matches;
  matches.num_tried = static_cast<int>(others.size());
  for (size_t i = 0; i < others.size(); ++i) {
    matches.match_s += results[i].product_s + results[i].guided_s;
    matches.verify_s += results[i].geometry_s;
    if (!IsVerified(results[i].geometry)) continue;
    matches.pairs.push_back(ToTwoViewPair(others[i]->image_id, results[i].geometry));
  }
  SortByInliers(&matches.pairs);
  matches.elapsed_s = timer.ElapsedS();
  return matches;
}

}  // namespace skein
