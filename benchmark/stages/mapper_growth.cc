// What a photo costs the mapper as its submap grows, on a walk along a street. The input are
// correspondences, not pixels, so hundreds of photos take minutes. Prints for each hundred photos:
//  - CPU time per photo of the registering thread and of the process,
//  - the longest wait of a photo, memory,
//  - how long a checkpoint stops registration.
// Last comes the ratio of photos 500-600 to photos 100-200.
//
//   mapper_growth [PHOTOS=600] [OBSERVATIONS_PER_PHOTO=1500]

#include <time.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <utility>
#include <vector>

#include "core/clock.h"
#include "core/process.h"
#include "core/snapshot.h"
#include "formats/formats.h"
#include "mapping/checkpoint.h"
#include "mapping/submap.h"
#include "testing/synthetic_scene.h"

namespace skein {
namespace {

constexpr double kStepM = 0.25, kDistanceM = 6;
constexpr double kHalfViewM = 0.6 * kDistanceM, kHalfHeightM = 0.45 * kDistanceM;
constexpr int kNumCandidates = 30;

double ThreadCpuS() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

SyntheticOptions CameraOptions() {
  SyntheticOptions options;
  options.noise_px = 0.5;
  options.detection_rate = 0.35;
  options.outlier_ratio = 0.05;
  options.max_pairs = kNumCandidates;
  return options;
}

// A façade with relief and the poses of a walk along it, back and forth in height.
SyntheticScene MakeStreet(int num_photos, int observations, std::mt19937* random) {
  const auto uniform = [random](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(*random);
  };
  SyntheticScene street;
  const double length_m = num_photos * kStepM + 4 * kHalfViewM;
  const double view_m2 = 4 * kHalfViewM * kHalfHeightM;
  const double density = observations / (CameraOptions().detection_rate * view_m2);
  const int num_points = static_cast<int>(length_m * 2 * kHalfHeightM * density);
  for (int i = 0; i < num_points; ++i) {
    const double x = uniform(0, length_m) - 2 * kHalfViewM;
    const double y = uniform(-kHalfHeightM, kHalfHeightM);
    street.points.emplace_back(x, y, kDistanceM + uniform(-1, 1));
  }
  for (int i = 0; i < num_photos; ++i) {
    const double yaw = 0.1 * std::sin(0.37 * i);
    street.AddPose(Eigen::AngleAxisd(-yaw, Eigen::Vector3d::UnitY()).matrix(),
                   {i * kStepM, 0.4 * std::sin(0.3 * i), 0.4 * std::cos(0.2 * i)});
  }
  return street;
}

struct Cost {
  double thread_s, process_s, wall_s;
};

struct Stop {
  double in_place_s, snapshot_s;
};

class Run {
 public:
  Run(int num_photos, int observations)
      : num_photos_(num_photos),
        street_(MakeStreet(num_photos, observations, &random_)),
        submap_(Options()) {}

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

  // The street keeps nothing of it but what later photos are matched with: memory is measured.
  std::pair<PhotoInput, TwoViewPairs> Take(int index) {
    PhotographNext(CameraOptions(), &random_, &street_);
    if (index >= kNumCandidates) street_.visible[index - kNumCandidates] = {};
    return {std::exchange(street_.photos[index], {}), std::exchange(street_.pairs[index], {})};
  }

  Cost Feed(int index) {
    const auto [photo, pairs] = Take(index);
    const Cost start{ThreadCpuS(), CpuTimeS(), MonotonicS()};
    submap_.AddPhoto(photo);
    submap_.AddPairs(photo.image_id, pairs);
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
  std::mt19937 random_{1};
  SyntheticScene street_;
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
