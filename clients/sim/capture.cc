#include "clients/sim/capture.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include "clients/places/crowd.h"
#include "clients/places/parallel.h"
#include "clients/places/random.h"
#include "core/angles.h"

namespace skein::sim {
namespace {

constexpr int64_t kSessionStartUs = 1777629600LL * 1000000;  // 2026-05-01 10:00:00 UTC
constexpr double kOriginLatitudeDeg = 48.1, kOriginLongitudeDeg = 11.5, kOriginAltitudeM = 520;
constexpr double kMetresPerDegree = 111320;

constexpr double kVideoReadoutS = 0.025, kVideoExposureS = 1.0 / 60;
constexpr double kVideoLagS = 0.5, kVideoGrey = 125;
constexpr int kVideoQuality = 78;
constexpr int kMeterWidth = 32, kMeterHeight = 24;

double FocalPx(const SimOptions& options) {
  return options.focal_px > 0 ? options.focal_px : 0.86 * options.width;
}

// Every agent has a body of its own: focal lengths differ by up to 2 %.
std::vector<Camera> BodyOfEachAgent(const SimOptions& options) {
  std::vector<Camera> cameras;
  for (int i = 0; i < options.scenario.agents; ++i) {
    Random random = Random(options.scenario.seed ^ 0x626f6479ULL).Fork(i);
    cameras.push_back({options.width, options.height, FocalPx(options) * random.Uniform(0.98, 1.02),
                       options.distortion * random.Uniform(0.9, 1.1)});
  }
  return cameras;
}

GpsPosition GpsAt(const Eigen::Vector3d& center, Random* random) {
  const double east = center.x() + 2 * random->Gaussian(),
               north = center.y() + 2 * random->Gaussian();
  return {kOriginLatitudeDeg + north / kMetresPerDegree,
          kOriginLongitudeDeg + east / (kMetresPerDegree * std::cos(DegToRad(kOriginLatitudeDeg))),
          kOriginAltitudeM + center.z() + 3 * random->Gaussian(),
          {}};
}

// `sensor_px`: the sensor's longer side, in the photo's pixels.
ExifInfo MakeExif(const SimOptions& options, const Camera& camera, const Capture& capture,
                  double sensor_px, Random* random) {
  ExifInfo info;
  info.make = "Skein";
  info.model = "Simulated camera " + std::to_string(capture.camera + 1);
  info.capture_utime_us = kSessionStartUs + std::llround(capture.shot.capture_s * 1e6);
  info.focal_35mm = static_cast<int>(std::lround(camera.focal_px * 36 / sensor_px));
  info.focal_mm = info.focal_35mm / 6.0;
  info.width = camera.width;
  info.height = camera.height;
  if (options.gps) info.gps = GpsAt(capture.shot.pose.center, random);
  return info;
}

// By the body of its agent, from a camera at rest.
void TakeStill(const SimOptions& options, int agent, const Camera& camera, Random* random,
               Capture* capture) {
  capture->camera = agent;
  capture->exposure.gain = random->Uniform(0.8, 1.2);
  capture->exposure.seed = random->Next();
  const double sensor_px = std::max(camera.width, camera.height);
  capture->exif = MakeExif(options, camera, *capture, sensor_px, random);
}

void TakeTouristPhoto(const SimOptions& options, const Place& place, Random* random,
                      CapturePlan* plan, Capture* capture) {
  const TouristCamera tourist = MakeTouristCamera(std::max(options.width, options.height), random);
  capture->camera = static_cast<int>(plan->cameras.size());
  plan->cameras.push_back(tourist.camera);
  capture->exposure = TouristExposure(random);
  capture->moving = PassersBy(capture->shot.pose, place.paint, place.cloth, random);
  capture->quality = random->Int(55, kJpegQuality);
  if (random->Chance(0.5)) {
    capture->exif = MakeExif(options, tourist.camera, *capture, tourist.sensor_px, random);
  }
}

// What the automatic exposure of a video sees of its frames.
std::vector<double> MeterFrames(const Place& place, const Camera& camera,
                                const std::vector<Shot>& shots, int threads) {
  Camera meter = camera;
  meter.width = kMeterWidth;
  meter.height = kMeterHeight;
  meter.focal_px *= static_cast<double>(kMeterWidth) / camera.width;
  std::vector<double> grey(shots.size());
  ParallelFor(static_cast<int>(shots.size()), threads, [&](int i) {
    const cv::Scalar mean = cv::mean(RenderLight(place, meter, {shots[i].pose, {}, {}}));
    grey[i] = (mean[0] + mean[1] + mean[2]) / 3;
  });
  return grey;
}

// The further the exposure must be raised, the noisier the frame.
void ExposeVideo(double gain, Random* random, Exposure* exposure) {
  exposure->gain = gain;
  exposure->vignetting = 0.2;
  exposure->noise_sigma = 2.4 * gain;
  exposure->shadow_noise = 11 * gain;
  exposure->softness_px = 0.7;
  exposure->seed = random->Next();
}

void FilmVideos(const SimOptions& options, const Place& place, const std::vector<Walk>& walks,
                CapturePlan* plan) {
  const int agents = static_cast<int>(walks.size());
  for (int agent = 0; agent < agents; ++agent) {
    Random random = Random(options.scenario.seed ^ 0x76696465ULL).Fork(agent);
    const std::vector<double> gains =
        AutoExposure(MeterFrames(place, plan->cameras[agent], walks[agent].shots, options.threads),
                     kVideoGrey, options.scenario.IntervalS(), kVideoLagS);
    for (size_t i = 0; i < gains.size(); ++i) {
      Capture& frame = plan->captures[i * agents + agent];
      frame.shutter = {kVideoExposureS, kVideoReadoutS};
      frame.quality = kVideoQuality;
      ExposeVideo(gains[i], &random, &frame.exposure);
    }
  }
}

Place WithSurfaces(const Place& place, const std::vector<Surface>& more) {
  Place whole = place;  // the pictures are shared
  std::vector<Surface> surfaces = more;
  for (int i = 0; i < place.scene.size(); ++i) surfaces.push_back(place.scene.surface(i).surface);
  whole.scene = Scene(surfaces);
  return whole;
}

}  // namespace

namespace {

std::string FileName(int index) {
  char file[32];
  std::snprintf(file, sizeof file, "%04d.jpg", index + 1);
  return file;
}

// Of an agent's photo: lens, light and clock.
Random RandomOf(const SimOptions& options, int agent, int index) {
  return Random(Random(options.scenario.seed ^ 0x70686f74ULL).Fork(agent * 100000 + index).Next());
}

}  // namespace

Capture CaptureAt(const SimOptions& options, const std::vector<Camera>& cameras, int agent,
                  const std::string& name, int index, const Pose& pose) {
  Capture capture;
  capture.agent = name;
  capture.file = FileName(index);
  capture.shot.pose = pose;
  capture.shot.capture_s = index * options.scenario.IntervalS();
  Random random = RandomOf(options, agent, index);
  TakeStill(options, agent, cameras[agent], &random, &capture);
  return capture;
}

CapturePlan PlanCaptures(const SimOptions& options, const Place& place) {
  const Scenario scenario = options.scenario.scenario;
  const std::vector<Walk> walks = PlanWalks(options.scenario);
  CapturePlan plan;
  if (scenario != Scenario::kCrowd) plan.cameras = BodyOfEachAgent(options);
  for (int i = 0; i < options.scenario.photos; ++i) {
    for (int agent = 0; agent < static_cast<int>(walks.size()); ++agent) {
      Capture capture;
      capture.agent = walks[agent].agent;
      capture.file = FileName(i);
      capture.shot = walks[agent].shots[i];
      Random random = RandomOf(options, agent, i);
      if (scenario == Scenario::kCrowd) {
        TakeTouristPhoto(options, place, &random, &plan, &capture);
      } else {
        TakeStill(options, agent, plan.cameras[agent], &random, &capture);
      }
      plan.captures.push_back(std::move(capture));
    }
  }
  if (scenario == Scenario::kVideo) FilmVideos(options, place, walks, &plan);
  return plan;
}

cv::Mat3b RenderCapture(const Place& place, const Camera& camera, const Capture& capture) {
  const View view{capture.shot.pose, capture.shot.motion, capture.shutter};
  const cv::Mat3f light = capture.moving.empty()
                              ? RenderLight(place, camera, view)
                              : RenderLight(WithSurfaces(place, capture.moving), camera, view);
  return Expose(light, capture.exposure);
}

}  // namespace skein::sim
