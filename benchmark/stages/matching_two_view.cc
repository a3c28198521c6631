// Cost of geometric verification on real photos: COLMAP's limits of trials against Skein's, on the
// same putative matches of pairs with and without overlap.
//
//   matching_two_view DIR [num_photos] [focal_px]
//
// Takes num_photos (default 24) photos spread evenly over DIR in name order, and all their pairs.
// focal_px > 0: taken as EXIF's (E is estimated); default 0: none (F and H only).

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <opencv2/features2d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "matching/kernel.h"
#include "matching/pair_matcher.h"
#include "matching/photo_features.h"
#include "matching/two_view.h"

namespace {

double ThreadCpuMs() {
  timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return 1e3 * t.tv_sec + 1e-6 * t.tv_nsec;
}

std::vector<std::string> PhotosOf(const std::string& dir, size_t count) {
  std::vector<std::string> all, some;
  for (const auto& entry : std::filesystem::directory_iterator(dir)) all.push_back(entry.path());
  std::sort(all.begin(), all.end());
  count = std::min(count, all.size());
  for (size_t i = 0; i < count; ++i) some.push_back(all[i * all.size() / count]);
  return some;
}

skein::PhotoFeatures Extract(const std::string& path, double focal_px) {
  const cv::Mat image = cv::imread(path, cv::IMREAD_GRAYSCALE | cv::IMREAD_IGNORE_ORIENTATION);
  std::vector<cv::KeyPoint> keypoints;
  cv::Mat descriptors;
  cv::SIFT::create(8192)->detectAndCompute(image, cv::noArray(), keypoints, descriptors);
  skein::PhotoFeatures photo;
  const double assumed_px = 1.2 * std::max(image.cols, image.rows);
  photo.camera = skein::PriorCamera(image.cols, image.rows, focal_px > 0 ? focal_px : assumed_px,
                                    focal_px > 0);
  for (int i = 0; i < descriptors.rows; ++i) {
    photo.points.emplace_back(keypoints[i].pt.x + 0.5, keypoints[i].pt.y + 0.5);
    const double sum = std::max(1e-9, cv::sum(descriptors.row(i))[0]);
    for (int k = 0; k < descriptors.cols; ++k) {
      const double root = std::sqrt(descriptors.at<float>(i, k) / sum);
      photo.descriptors.push_back(cv::saturate_cast<uint8_t>(512 * root));
    }
  }
  photo.descriptors = skein::CompactDescriptors(std::move(photo.descriptors));
  return photo;
}

struct Totals {
  int kept = 0;
  long inliers = 0;
  double kept_ms = 0, rejected_ms = 0;

  void Add(const skein::TwoViewGeometry& geometry, double ms) {
    const bool verified = skein::IsVerified(geometry);
    (verified ? kept_ms : rejected_ms) += ms;
    if (!verified) return;
    ++kept;
    inliers += static_cast<long>(geometry.inlier_matches.size());
  }

  void Print(const char* name, int pairs) const {
    std::printf(
        "%-22s kept %4d of %4d pairs, %7ld inliers; kept %6.1f ms, rejected %6.1f ms a pair\n",
        name, kept, pairs, inliers, kept_ms / std::max(1, kept),
        rejected_ms / std::max(1, pairs - kept));
  }
};

skein::TwoViewGeometry ByColmap(const skein::PhotoFeatures& a, const skein::PhotoFeatures& b,
                                const skein::FeatureMatches& matches) {
  skein::RansacLimits limits;
  limits.max_error = skein::limits::kMaxErrorPx;
  limits.confidence = skein::kTwoViewConfidence;
  limits.min_inlier_ratio = skein::kMinPairInlierRatio;
  limits.max_num_trials = 10000;
  return skein::EstimateByColmap({a.camera, a.points, b.camera, b.points}, matches, limits);
}

skein::TwoViewGeometry ByOneSearch(const skein::PhotoFeatures& a, const skein::PhotoFeatures& b,
                                   const skein::FeatureMatches& matches) {
  return skein::EstimateTwoView(a.camera, a.points, b.camera, b.points, matches,
                                skein::PairSeed(a.image_id, b.image_id));
}

template <class Estimate>
skein::TwoViewGeometry Verify(const Estimate& estimate, const skein::PhotoFeatures& a,
                              const skein::PhotoFeatures& b, const skein::FeatureMatches& matches,
                              Totals* totals) {
  const double start = ThreadCpuMs();
  const skein::TwoViewGeometry geometry = estimate(a, b, matches);
  totals->Add(geometry, ThreadCpuMs() - start);
  return geometry;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: matching_two_view DIR [num_photos] [focal_px]\n");
    return 2;
  }
  cv::setNumThreads(1);
  const double focal_px = argc > 3 ? std::atof(argv[3]) : 0;
  std::vector<skein::PhotoFeatures> photos;
  for (const std::string& path : PhotosOf(argv[1], argc > 2 ? std::atoi(argv[2]) : 24)) {
    photos.push_back(Extract(path, focal_px));
    photos.back().image_id = static_cast<int64_t>(photos.size());
  }
  std::printf("commit: %s\n%zu photos, CPU time of one thread\n", SKEIN_COMMIT, photos.size());

  skein::DescriptorMatcher matcher{skein::MatchOptions()};
  Totals colmap_limits, our_limits;
  double match_ms = 0;
  int pairs = 0, differ = 0;
  for (const auto& a : photos) {
    for (const auto& b : photos) {
      if (a.image_id <= b.image_id) continue;
      const double start = ThreadCpuMs();
      skein::FeatureMatches matches;
      auto found = matcher.Match({a.descriptors.data(), int(a.points.size())},
                                 {b.descriptors.data(), int(b.points.size())});
      std::sort(found.begin(), found.end(),
                [](const auto& x, const auto& y) { return x.ratio_sq < y.ratio_sq; });
      for (const auto& m : found) matches.emplace_back(m.first, m.second);
      match_ms += ThreadCpuMs() - start;
      ++pairs;
      const auto theirs = Verify(ByColmap, a, b, matches, &colmap_limits);
      const auto ours = Verify(ByOneSearch, a, b, matches, &our_limits);
      differ += theirs.config != ours.config ||
                theirs.inlier_matches.size() != ours.inlier_matches.size();
    }
  }
  std::printf("descriptor matching    %6.1f ms a pair\n", match_ms / std::max(1, pairs));
  colmap_limits.Print("COLMAP's limits", pairs);
  our_limits.Print("limits by outcome", pairs);
  std::printf("%d pairs differ in configuration or number of inliers\n", differ);
  return 0;
}
