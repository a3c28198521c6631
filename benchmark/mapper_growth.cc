// What a photo costs the mapper as its submap grows: a walk along a street in correspondences (no
// pixels), so that hundreds of photos take minutes. Prints for each hundred photos:
//  - CPU time per photo of the registering thread and of the process,
//  - the longest wait of a photo, memory,
//  - how long a checkpoint stops registration.
// Last comes the ratio of photos 500-600 to photos 100-200.
//
//   mapper_growth [PHOTOS=600] [OBSERVATIONS_PER_PHOTO=1500]

#include <time.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <random>
#include <vector>

#include "core/clock.h"
#include "core/process.h"
#include "core/snapshot.h"
#include "formats/formats.h"
#include "mapping/checkpoint.h"
#include "mapping/submap.h"

namespace skein {
namespace {

constexpr int kWidth = 1200, kHeight = 900;
constexpr double kFocal = 1000, kStepM = 0.25, kDistanceM = 6;
constexpr double kHalfViewM = 0.6 * kDistanceM, kHalfHeightM = 0.45 * kDistanceM;
constexpr double kDetected = 0.35;  // a point is found again in this part of the photos that see it
constexpr int kNumCandidates = 30;
constexpr double kNoisePx = 0.5;
constexpr double kOutliers = 0.05;

double ThreadCpuS() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

// A façade with relief, photographed while walking along it, back and forth in height.
class Street {
 public:
  Street(int num_photos, int observations) : random_(1) {
    const double length = num_photos * kStepM + 4 * kHalfViewM;
    const double density = observations / (kDetected * 4 * kHalfViewM * kHalfHeightM);
    const int count = static_cast<int>(length * 2 * kHalfHeightM * density);
    for (int i = 0; i < count; ++i) {
      points_.push_back({length * Uniform() - 2 * kHalfViewM, 2 * kHalfHeightM * (Uniform() - 0.5),
                         kDistanceM + 2 * Uniform() - 1});
    }
    std::sort(points_.begin(), points_.end(),
              [](const auto& a, const auto& b) { return a.x() < b.x(); });
  }

  PhotoInput Take(int index) {
    PhotoInput photo;
    photo.image_id = index + 1;
    photo.camera_id = 1;
    photo.name = "walk/" + std::to_string(index) + ".jpg";
    photo.width_px = kWidth;
    photo.height_px = kHeight;
    photo.focal_px = kFocal;
    photo.focal_from_exif = true;
    const Eigen::Vector3d center(index * kStepM, 0.4 * std::sin(0.3 * index),
                                 0.4 * std::cos(0.2 * index));
    const double yaw = 0.1 * std::sin(0.37 * index);
    std::map<int, uint32_t>& keypoint_of = keypoint_of_[index];
    const auto begin =
        std::lower_bound(points_.begin(), points_.end(), center.x() - 2 * kHalfViewM,
                         [](const Eigen::Vector3d& point, double x) { return point.x() < x; });
    for (auto it = begin; it != points_.end() && it->x() < center.x() + 2 * kHalfViewM; ++it) {
      const Eigen::Vector3d d = *it - center;
      const double x = std::cos(yaw) * d.x() - std::sin(yaw) * d.z();
      const double z = std::sin(yaw) * d.x() + std::cos(yaw) * d.z();
      const double u = kFocal * x / z + kWidth / 2.0 + kNoisePx * Normal();
      const double v = kFocal * d.y() / z + kHeight / 2.0 + kNoisePx * Normal();
      if (u < 0 || v < 0 || u >= kWidth || v >= kHeight || Uniform() > kDetected) continue;
      keypoint_of[static_cast<int>(it - points_.begin())] =
          static_cast<uint32_t>(photo.keypoints.size());
      photo.keypoints.push_back(
          {static_cast<float>(u), static_cast<float>(v), 1, 0, 100, 100, 100});
    }
    keypoint_of_.erase(index - kNumCandidates - 1);
    return photo;
  }

  TwoViewPairs Match(int index) {
    TwoViewPairs pairs;
    for (int other = index - 1; other >= 0 && other >= index - kNumCandidates; --other) {
      TwoViewPair pair;
      pair.other_id = other + 1;
      for (const auto& [point, keypoint] : keypoint_of_[index]) {
        const auto it = keypoint_of_[other].find(point);
        if (it != keypoint_of_[other].end()) pair.inliers.emplace_back(keypoint, it->second);
      }
      for (size_t i = 0; i + 1 < pair.inliers.size(); i += 2) {
        if (Uniform() < kOutliers) std::swap(pair.inliers[i].second, pair.inliers[i + 1].second);
      }
      if (pair.inliers.size() >= 15) pairs.push_back(pair);
    }
    return pairs;
  }

 private:
  double Uniform() { return std::uniform_real_distribution<double>()(random_); }
  double Normal() { return std::normal_distribution<double>()(random_); }
  std::mt19937 random_;
  std::vector<Eigen::Vector3d> points_;
  std::map<int, std::map<int, uint32_t>> keypoint_of_;  // photo -> point -> keypoint
};

struct Cost {
  double thread_s, process_s, wall_s;
};

struct Stop {
  double in_place_s, snapshot_s;
};

class Run {
 public:
  Run(int num_photos, int observations)
      : num_photos_(num_photos), street_(num_photos, observations), submap_(Options()) {}

  void Execute() {
    std::printf("%6s %12s %13s %11s %9s %9s %11s %12s\n", "photos", "thread ms", "process ms",
                "longest ms", "MB", "points", "encode ms", "snapshot ms");
    for (int i = 0; i < num_photos_; ++i) {
      costs_.push_back(Feed(i));
      if ((i + 1) % 100 == 0) PrintHundred(i + 1);
    }
    if (num_photos_ >= 600) {
      std::printf("photos 500-600 over 100-200: registering thread %.2f, whole process %.2f\n",
                  Mean(500, 600, &Cost::thread_s) / Mean(100, 200, &Cost::thread_s),
                  Mean(500, 600, &Cost::process_s) / Mean(100, 200, &Cost::process_s));
    }
    const SubmapStatistics s = submap_.Statistics();
    std::printf(
        "registered %d/%d, %.2f observations a point, %.3f px, peak memory %.0f MB (%.2f MB "
        "a photo)\n",
        s.num_images, num_photos_, s.mean_track_length, s.mean_reprojection_error_px,
        PeakMemoryBytes() * 1e-6, PeakMemoryBytes() * 1e-6 / num_photos_);
  }

 private:
  static SubmapOptions Options() {
    SubmapOptions options;
    options.background = true;
    return options;
  }

  Cost Feed(int index) {
    const PhotoInput photo = street_.Take(index);
    const TwoViewPairs pairs = street_.Match(index);
    const Cost start{ThreadCpuS(), CpuTimeS(), MonotonicS()};
    std::vector<std::pair<uint32_t, double>> distances;
    for (const TwoViewPair& pair : pairs) {
      const double overlap = 1.0 - static_cast<double>(index + 1 - pair.other_id) / kNumCandidates;
      distances.emplace_back(pair.other_id, 2.0 * std::sqrt(1.0 - overlap));
    }
    submap_.AddPhoto(photo);
    submap_.AddPairs(photo.image_id, pairs);
    submap_.AddSimilar(photo.image_id, distances);
    const auto ignore = [](const PhotoEvent&) {};
    if (submap_.map().reconstruction().NumRegImages() > 0) {
      submap_.Enqueue(photo.image_id);
    } else if (index >= 8) {
      submap_.Start(InitialPairOptions(), 1, photo.image_id, ignore);
    }
    while (submap_.Step(ignore)) continue;
    return {ThreadCpuS() - start.thread_s, CpuTimeS() - start.process_s,
            MonotonicS() - start.wall_s};
  }

  double Mean(int from, int to, double Cost::*member) const {
    double sum = 0;
    for (int i = from; i < to; ++i) sum += costs_[i].*member;
    return sum / (to - from);
  }

  // How long a checkpoint keeps the map from registering, both ways.
  Stop MeasureCheckpoint() {
    double start = MonotonicS();
    const Bytes bytes = EncodeModelArchive(SaveSubmap(&submap_));
    const double in_place_s = MonotonicS() - start;
    start = MonotonicS();
    const auto snapshot =
        Snapshot::Take([this] { return EncodeModelArchive(SaveSubmap(&submap_)); });
    const double snapshot_s = MonotonicS() - start;
    if (!snapshot.ok() || !(*snapshot)->Read().ok()) throw std::runtime_error("no snapshot");
    return {in_place_s, snapshot_s};
  }

  void PrintHundred(int to) {
    double longest = 0;
    for (int i = to - 100; i < to; ++i) longest = std::max(longest, costs_[i].wall_s);
    const Stop stop = MeasureCheckpoint();
    std::printf("%6d %12.1f %13.1f %11.0f %9.0f %9zu %11.0f %12.1f\n", to,
                1e3 * Mean(to - 100, to, &Cost::thread_s),
                1e3 * Mean(to - 100, to, &Cost::process_s), 1e3 * longest,
                ResidentMemoryBytes() * 1e-6,
                static_cast<size_t>(submap_.map().reconstruction().NumPoints3D()),
                1e3 * stop.in_place_s, 1e3 * stop.snapshot_s);
    std::fflush(stdout);
  }

  const int num_photos_;
  Street street_;
  Submap submap_;
  std::vector<Cost> costs_;
};

}  // namespace
}  // namespace skein

int main(int argc, char** argv) {
  const int num_photos = argc > 1 ? std::atoi(argv[1]) : 600;
  const int observations = argc > 2 ? std::atoi(argv[2]) : 1500;
  if (num_photos < 10 || observations < 100) {
    std::fprintf(stderr, "mapper_growth [PHOTOS >= 10] [OBSERVATIONS_PER_PHOTO >= 100]\n");
    return 2;
  }
  std::printf("commit %s, %s\n", SKEIN_COMMIT, skein::HostName().c_str());
  skein::Run(num_photos, observations).Execute();
  return 0;
}
