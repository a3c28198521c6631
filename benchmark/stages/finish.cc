// What a finish costs a submap of one place, and how exact the model is. The input are
// correspondences, not pixels: photos of one place by four agents who walk around it. Half of a
// photo's keypoints are of an object in the middle, which most photos see. So the tracks grow with
// the number of photos: a bundle adjustment costs most here.
//
// Photos come as fast as they are placed. Then: "at rest", until the background adjustment has
// nothing left to do; "consolidate", what a mapper does at DRAINED; "finish", what it does at
// SETTLED. "bound": 5 s + 0.03 s a photo, of consolidate and finish together.
//
// Seconds are of CPU, of all threads; "wall" those of consolidate and finish together.
//
//   finish [--photos N,N...] [--observations 700] [--threads 2] [--no-rest] [--captures DIR]

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "core/clock.h"
#include "core/file.h"
#include "core/log.h"
#include "core/process.h"
#include "geometry/model_poses.h"
#include "geometry/pose_evaluation.h"
#include "mapping/checkpoint.h"
#include "mapping/submap.h"
#include "testing/synthetic_scene.h"
#include "testing/test_random.h"

namespace skein {
namespace {

constexpr int kNumAgents = 4;
constexpr size_t kNumCandidates = 30;
constexpr double kRadiusM = 3;
constexpr double kMeanDetection = 0.225;

struct Arguments {
  std::vector<int> photos = {60, 128, 300};
  int observations = 700;
  int threads = 2;
  bool rest = true;
  std::string captures;
};

SyntheticOptions CameraOptions() {
  SyntheticOptions options;
  options.camera.width_px = 640;
  options.camera.height_px = 480;
  options.camera.focal_px = 550;
  options.camera.distortion = -0.05;
  options.noise_px = 0.5;
  options.num_clutter = 100;
  options.outlier_ratio = 0.02;
  return options;
}

// An object in the middle of a room, and the room's walls.
class Place {
 public:
  Place(int num_photos, int observations) {
    // The share of the wall's points that a photo has in view is about 0.15.
    AddPoints(observations / 2 / kMeanDetection, [this] { return OnObject(); });
    AddPoints(observations / 2 / (0.15 * kMeanDetection), [this] { return OnWall(); });
    const int steps = (num_photos + kNumAgents - 1) / kNumAgents;
    for (int i = 0; i < num_photos; ++i) AddPose(i % kNumAgents, i / kNumAgents, steps);
  }

  const PhotoInput& TakeNext(TwoViewPairs* pairs) {
    PhotographNext(CameraOptions(), &random_, &scene_);
    *pairs = std::exchange(scene_.pairs.back(), {});
    std::stable_sort(pairs->begin(), pairs->end(), [](const auto& a, const auto& b) {
      return a.inliers.size() > b.inliers.size();
    });
    if (pairs->size() > kNumCandidates) pairs->resize(kNumCandidates);
    return scene_.photos.back();
  }

  ModelPoses Truth() const {
    ModelPoses truth;
    for (size_t i = 0; i < scene_.photos.size(); ++i) {
      truth.poses.push_back({scene_.photos[i].name,
                             {Eigen::Quaterniond(scene_.rotations[i]), scene_.translations[i]}});
    }
    return truth;
  }

 private:
  double Draw(double low, double high) { return Uniform(low, high, &random_); }

  // Few points are found in most photos, many in few.
  template <typename Function>
  void AddPoints(double count, const Function& draw) {
    for (int i = 0; i < static_cast<int>(count); ++i) {
      scene_.points.push_back(draw());
      scene_.detection_of_point.push_back(0.9 * std::pow(Draw(0, 1), 3));
    }
  }
  Eigen::Vector3d OnObject() { return {Draw(-1, 1), Draw(-0.8, 0.8), Draw(-1, 1)}; }
  Eigen::Vector3d OnWall() {
    const double angle = Draw(-M_PI, M_PI), radius = Draw(5, 7);
    return {radius * std::cos(angle), Draw(-2.5, 2.5), radius * std::sin(angle)};
  }

  // Agents walk once around the object, each from another side, and look at it.
  void AddPose(int agent, int step, int num_steps) {
    const double angle = 2 * M_PI * (static_cast<double>(step) / num_steps + 0.25 * agent);
    const double radius = kRadiusM + 0.4 * agent + Draw(-0.1, 0.1);
    const Eigen::Vector3d center(radius * std::cos(angle), 0.3 * agent - 0.5 + Draw(-0.1, 0.1),
                                 radius * std::sin(angle));
    const Eigen::Vector3d z = -center.normalized();
    const Eigen::Vector3d x = Eigen::Vector3d::UnitY().cross(z).normalized();
    Eigen::Matrix3d R;
    R.row(0) = x;
    R.row(1) = z.cross(x);
    R.row(2) = z;
    const double yaw = Draw(-0.15, 0.15);
    scene_.AddPose(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitY()) * R, center);
  }

  std::mt19937 random_{1};
  SyntheticScene scene_;
};

class Run {
 public:
  Run(const Arguments& arguments, int num_photos)
      : arguments_(arguments),
        num_photos_(num_photos),
        place_(num_photos, arguments.observations),
        submap_(Options(arguments)) {}

  void Execute() {
    const double capture_s = CpuSecondsOf([this] { Capture(); });
    const double rest_s = CpuSecondsOf([this] { Rest(); });
    const double rmse_before = RmsePercent();
    const Timer wall;
    const double consolidate_s = CpuSecondsOf([this] { submap_.Consolidate(Ignore); });
    const double finish_s = CpuSecondsOf([this] { submap_.Finish(Ignore); });
    const SubmapStatistics s = submap_.Statistics();
    std::printf(
        "| %d | %d | %d | %.1f | %.0f | %.1f | %.1f | %.1f | %.1f | %.1f | %.4f | %.4f | %.4f |\n",
        num_photos_, s.num_images, s.num_points, s.mean_track_length, capture_s, rest_s,
        consolidate_s, finish_s, wall.ElapsedS(), 5 + 0.03 * num_photos_,
        s.mean_reprojection_error_px, rmse_before, RmsePercent());
    std::fflush(stdout);
  }

 private:
  static SubmapOptions Options(const Arguments& arguments) {
    SubmapOptions options;
    options.background = true;
    options.num_threads = arguments.threads;
    return options;
  }
  static void Ignore(const PhotoEvent&) {}

  template <typename Function>
  static double CpuSecondsOf(const Function& function) {
    const double start_s = CpuTimeS();
    function();
    return CpuTimeS() - start_s;
  }

  // Takes up an earlier run's capture where one is kept.
  void Capture() {
    const std::filesystem::path file =
        std::filesystem::path(arguments_.captures) /
        fmt::format("{}_{}.bin", num_photos_, arguments_.observations);
    const bool keep = !arguments_.captures.empty();
    const bool exists = keep && std::filesystem::exists(file);
    for (int i = 0; i < num_photos_; ++i) Feed(!exists);
    if (exists) Restore(file);
    if (!keep || exists) return;
    const Bytes bytes = EncodeModelArchive(SaveSubmap(&submap_));
    ThrowUnlessOk(WriteFileAtomic(file.string(), bytes));
  }

  void Restore(const std::filesystem::path& file) {
    const Result<Bytes> bytes = ReadFile(file.string());
    ThrowUnlessOk(bytes.status());
    const Result<ModelArchive> archive = DecodeModelArchive(*bytes);
    ThrowUnlessOk(archive.status());
    ThrowUnlessOk(RestoreSubmap(*archive, &submap_));
  }

  static void ThrowUnlessOk(const Status& status) {
    if (!status.ok()) throw std::runtime_error(status.error());
  }

  void Rest() {
    while (arguments_.rest && submap_.Maintain(std::numeric_limits<double>::infinity(), Ignore)) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }

  void Feed(bool place) {
    TwoViewPairs pairs;
    const PhotoInput& photo = place_.TakeNext(&pairs);
    submap_.AddPhoto(photo);
    submap_.AddPairs(photo.image_id, pairs);
    if (!place) return;
    if (submap_.map().reconstruction().NumRegImages() == 0) return Start(photo.image_id, pairs);
    submap_.Enqueue(photo.image_id);
    while (submap_.Step(Ignore)) continue;
  }

  void Start(int64_t image_id, const TwoViewPairs& pairs) {
    for (const TwoViewPair& pair : pairs) {
      if (submap_.Start(InitialPairOptions(), pair.other_id, image_id, Ignore).status.ok()) break;
    }
    while (submap_.Step(Ignore)) continue;
  }

  double RmsePercent() const {
    ModelPoses model;
    for (const ImageId id : submap_.map().reconstruction().RegImageIds()) {
      const Image& image = submap_.map().reconstruction().Image(id);
      const Eigen::Vector4d& q = image.Qvec();
      model.poses.push_back(
          {image.Name(), {Eigen::Quaterniond(q(0), q(1), q(2), q(3)).normalized(), image.Tvec()}});
    }
    const Result<PoseEvaluation> evaluation = EvaluatePoses(model, place_.Truth());
    return evaluation.ok() ? evaluation->PositionPercent(evaluation->position.rmse) : NAN;
  }

  const Arguments arguments_;
  const int num_photos_;
  Place place_;
  Submap submap_;
};

void Execute(const Arguments& arguments) {
  std::printf("commit %s, %s, %d threads\n\n", SKEIN_COMMIT, HostName().c_str(), arguments.threads);
  std::printf(
      "| photos | registered | points | track length | capture s | at rest s | consolidate s | "
      "finish s | wall s | bound s | MRE px | RMSE before, %% of extent | after |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  for (const int num_photos : arguments.photos) Run(arguments, num_photos).Execute();
}

}  // namespace
}  // namespace skein

int main(int argc, char** argv) {
  skein::Arguments arguments;
  CLI::App app("What a finish costs a submap of one place");
  app.add_option("--photos", arguments.photos, "One run for each")
      ->delimiter(',')
      ->check(CLI::Range(10, 5000));
  app.add_option("--observations", arguments.observations, "Keypoints of points a photo, about")
      ->check(CLI::Range(100, 10'000));
  app.add_option("--threads", arguments.threads, "Of bundle adjustments in turn")
      ->check(CLI::Range(1, 1024));
  app.add_flag("!--no-rest", arguments.rest, "Finish right after the last photo");
  app.add_option("--captures", arguments.captures,
                 "Folder where maps as captured are kept for the next run")
      ->check(CLI::ExistingDirectory);
  CLI11_PARSE(app, argc, argv);
  skein::InitLog("finish", false);
  skein::Execute(arguments);
  return 0;
}
