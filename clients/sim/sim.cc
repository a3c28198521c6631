#include "clients/sim/sim.h"

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <stdexcept>
#include <thread>

#include "clients/progress_bar.h"
#include "clients/sim/parallel.h"
#include "clients/sim/photo_file.h"
#include "clients/sim/publish.h"
#include "clients/sim/random.h"
#include "clients/sim/render.h"
#include "clients/sim/truth.h"
#include "clients/subcommand.h"

namespace skein::sim {
namespace {

namespace fs = std::filesystem;

constexpr int64_t kSessionStartUs = 1777629600LL * 1000000;  // 2026-05-01 10:00:00 UTC
constexpr GpsTag kOrigin{48.1, 11.5, 520};
constexpr double kMetresPerDegree = 111320;

struct Job {
  std::string agent, file;
  int camera;
  Shot shot;
  uint64_t seed;
};

// Every agent has a body of its own: focal lengths differ by up to 2 %.
std::vector<Camera> MakeCameras(const SimOptions& options) {
  std::vector<Camera> cameras;
  for (int i = 0; i < options.scenario.agents; ++i) {
    Random random = Random(options.scenario.seed ^ 0x626f6479ULL).Fork(i);
    const double focal_px = options.focal_px > 0 ? options.focal_px : 0.86 * options.width;
    cameras.push_back({options.width, options.height, focal_px * random.Uniform(0.98, 1.02),
                       options.distortion * random.Uniform(0.9, 1.1)});
  }
  return cameras;
}

GpsTag GpsAt(const Eigen::Vector3d& center, Random* random) {
  const double east = center.x() + 2 * random->Gaussian(),
               north = center.y() + 2 * random->Gaussian();
  return {kOrigin.latitude_deg + north / kMetresPerDegree,
          kOrigin.longitude_deg +
              east / (kMetresPerDegree * std::cos(kOrigin.latitude_deg * M_PI / 180)),
          kOrigin.altitude_m + center.z() + 3 * random->Gaussian()};
}

ExifInfo MakeExif(const SimOptions& options, const Camera& camera, const Job& job, Random* random) {
  ExifInfo info;
  info.make = "Skein";
  info.model = "Simulated camera " + std::to_string(job.camera + 1);
  info.capture_utime_us = kSessionStartUs + std::llround(job.shot.capture_s * 1e6);
  info.focal_35mm =
      static_cast<int>(std::lround(camera.focal_px * 36 / std::max(camera.width, camera.height)));
  info.focal_mm = info.focal_35mm / 6.0;
  info.width = camera.width;
  info.height = camera.height;
  if (options.gps) info.gps = GpsAt(job.shot.pose.center, random);
  return info;
}

void WriteWhole(const fs::path& path, const std::vector<uint8_t>& bytes) {
  const fs::path partial = path.string() + ".part";
  std::ofstream file(partial, std::ios::binary);
  file.write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
  file.close();
  if (!file) throw std::runtime_error("cannot write " + partial.string());
  fs::rename(partial, path);
}

void RenderJob(const SimOptions& options, const Place& place, const Camera& camera,
               const Job& job) {
  Random random(job.seed);
  Exposure exposure;
  exposure.gain = random.Uniform(0.8, 1.2);
  exposure.seed = random.Next();
  const cv::Mat3b image = RenderPhoto(place, camera, job.shot.pose, exposure);
  const ExifInfo exif = MakeExif(options, camera, job, &random);
  WriteWhole(fs::path(options.out) / "images" / job.agent / job.file,
             EncodePhoto(image, options.exif ? &exif : nullptr, options.quality));
}

std::vector<Job> PlanJobs(const SimOptions& options, const std::vector<Walk>& walks) {
  std::vector<Job> jobs;
  const Random seeds(options.scenario.seed ^ 0x70686f74ULL);
  for (int i = 0; i < options.scenario.photos; ++i) {  // in the order in which they are taken
    for (int agent = 0; agent < static_cast<int>(walks.size()); ++agent) {
      char file[32];
      std::snprintf(file, sizeof file, "%04d.jpg", i + 1);
      jobs.push_back({walks[agent].agent, file, agent, walks[agent].shots[i],
                      seeds.Fork(agent * 100000 + i).Next()});
    }
  }
  return jobs;
}

}  // namespace

std::vector<RenderedAgent> RenderSession(const SimOptions& options) {
  const std::vector<Walk> walks = PlanWalks(options.scenario);
  const std::vector<Camera> cameras = MakeCameras(options);
  const std::vector<Job> jobs = PlanJobs(options, walks);
  std::vector<RenderedAgent> agents;
  for (const Walk& walk : walks) {
    agents.push_back({walk.agent, (fs::path(options.out) / "images" / walk.agent).string()});
    fs::create_directories(agents.back().folder);
  }
  const Place place = BuildPlace(options.scenario, options.threads);
  std::vector<TruePhoto> photos;
  for (const Job& job : jobs) {
    photos.push_back({job.agent + "/" + job.file, job.camera, job.shot.pose});
  }
  const fs::path truth = fs::path(options.out) / "truth";
  WriteTruth(truth.string(), place, cameras, photos, options.scenario.seed, options.threads);
  WriteSurfaces((truth / "surfaces.ply").string(), place.scene);
  ProgressBar progress("rendering", static_cast<int64_t>(jobs.size()));
  ParallelFor(static_cast<int>(jobs.size()), options.threads, [&](int i) {
    RenderJob(options, place, cameras[jobs[i].camera], jobs[i]);
    progress.Add();
  });
  return agents;
}

}  // namespace skein::sim

namespace skein {
namespace {

struct SimCommand {
  sim::SimOptions sim;
  std::string scenario = "together", size = "1280x960";
  std::string session, session_id, lcm_url, rate;

  bool publishes() const { return !session.empty() || !session_id.empty(); }
};

void AddRenderOptions(CLI::App* app, SimCommand* command) {
  sim::SimOptions& options = command->sim;
  app->add_option("--output,--out", options.out,
                  "Folder for images/AGENT/NAME.jpg and truth (a COLMAP text model)")
      ->required();
  app->add_option("--agents", options.scenario.agents, "How many agents")
      ->check(CLI::Range(1, 64))
      ->capture_default_str();
  app->add_option("--photos", options.scenario.photos, "How many photos each agent takes")
      ->check(CLI::Range(2, 5000))
      ->capture_default_str();
  app->add_option("--seed", options.scenario.seed, "The place and the walks are a function of it")
      ->capture_default_str();
  app->add_option("--scenario", command->scenario, "Who walks where: see clients/README.md")
      ->check(CLI::IsMember(sim::ScenarioNames()))
      ->capture_default_str();
  app->add_option("--size", command->size, "Of the photos, WIDTHxHEIGHT")->capture_default_str();
  app->add_option("--focal-px", options.focal_px, "Focal length (0: 0.86 of the width)")
      ->check(CLI::NonNegativeNumber);
  app->add_option("--distortion", options.distortion, "k of COLMAP's SIMPLE_RADIAL")
      ->check(CLI::Range(-0.15, 0.15))
      ->capture_default_str();
  app->add_flag("!--no-exif", options.exif, "Leave the EXIF out");
  app->add_flag("--gps", options.gps, "Put a GPS position (2 m noise) into the EXIF");
  app->add_option("--threads", options.threads, "Photos rendered at a time")
      ->check(CLI::Range(1, 256));
}

void AddPublishOptions(CLI::App* app, SimCommand* command) {
  const std::string group = "Publishing (after rendering, as `skein agent` does)";
  app->add_option("--session", command->session, "Publish to the session in this folder")
      ->group(group);
  app->add_option("--session-id", command->session_id, "Publish to the session of this id")
      ->group(group);
  app->add_option("--lcm-url", command->lcm_url, "Its LCM URL")->group(group);
  app->add_option("--rate", command->rate, "Photos a second of each agent")->group(group);
}

sim::PublishOptions MakePublishOptions(const SimCommand& command) {
  sim::PublishOptions options;
  const auto pass = [&](const std::string& name, const std::string& value) {
    if (value.empty()) return;
    options.session.push_back(name);
    options.session.push_back(value);
  };
  pass("--session", command.session);
  pass("--session-id", command.session_id);
  pass("--lcm-url", command.lcm_url);
  pass("--rate", command.rate);
  options.one_after_the_other = command.sim.scenario.scenario == sim::Scenario::kRelay;
  return options;
}

bool ParseSize(const std::string& text, int* width, int* height) {
  char rest = 0;
  return std::sscanf(text.c_str(), "%dx%d%c", width, height, &rest) == 2 && *width >= 64 &&
         *height >= 64 && *width <= 8192 && *height <= 8192;
}

}  // namespace

int RunSim(int argc, char** argv) {
  SimCommand command;
  command.sim.threads = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  CLI::App app(
      "Renders a synthetic place as its agents photograph it, with the exact poses; given a\n"
      "session, publishes the photos to it.",
      "skein sim");
  AddRenderOptions(&app, &command);
  AddPublishOptions(&app, &command);
  if (const auto code = ParseOptions(&app, argc, argv)) return *code;
  if (!ParseSize(command.size, &command.sim.width, &command.sim.height)) {
    std::cerr << "skein sim: --size takes WIDTHxHEIGHT between 64x64 and 8192x8192\n";
    return kExitUsage;
  }
  command.sim.scenario.scenario = *sim::ParseScenario(command.scenario);
  const std::vector<sim::RenderedAgent> agents = sim::RenderSession(command.sim);
  for (const sim::RenderedAgent& agent : agents) {
    std::cout << agent.name << " " << agent.folder << std::endl;
  }
  if (!command.publishes()) return kExitOk;
  return sim::PublishSession("/proc/self/exe", agents, MakePublishOptions(command));
}

}  // namespace skein
