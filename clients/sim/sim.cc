#include "clients/sim/sim.h"

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <stdexcept>
#include <thread>

#include "clients/client_node.h"
#include "clients/places/parallel.h"
#include "clients/places/truth.h"
#include "clients/progress_bar.h"
#include "clients/sim/publish.h"
#include "clients/sim/robots.h"
#include "clients/subcommand.h"
#include "event_loop/worker_thread.h"

namespace skein::sim {
namespace {

namespace fs = std::filesystem;

void WriteWhole(const fs::path& path, const std::vector<uint8_t>& bytes) {
  const fs::path partial = path.string() + ".part";
  std::ofstream file(partial, std::ios::binary);
  file.write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
  file.close();
  if (!file) throw std::runtime_error("cannot write " + partial.string());
  fs::rename(partial, path);
}

void RenderToFile(const SimOptions& options, const Place& place, const Camera& camera,
                  const Capture& capture) {
  const cv::Mat3b image = RenderCapture(place, camera, capture);
  const ExifInfo* exif = capture.exif ? &*capture.exif : nullptr;
  WriteWhole(fs::path(options.out) / "images" / capture.agent / capture.file,
             EncodePhoto(image, exif, capture.quality));
}

void WriteWholeTruth(const SimOptions& options, const Place& place,
                     const std::vector<Camera>& cameras, const std::vector<Capture>& captures) {
  std::vector<TruePhoto> photos;
  for (const Capture& capture : captures) {
    photos.push_back({capture.agent + "/" + capture.file, capture.camera, capture.shot.pose,
                      capture.moving.empty() ? Scene() : Scene(capture.moving)});
  }
  const fs::path truth = fs::path(options.out) / "truth";
  WriteTruth(truth.string(), place, cameras, photos, options.scenario.seed, options.threads);
  WriteSurfaces((truth / "surfaces.ply").string(), place.scene);
}

std::vector<RenderedAgent> MakeFolders(const SimOptions& options) {
  std::vector<RenderedAgent> agents;
  for (const Walk& walk : PlanWalks(options.scenario)) {
    const std::string& name = walk.agent;
    agents.push_back({name, (fs::path(options.out) / "images" / name).string()});
    fs::create_directories(agents.back().folder);
  }
  return agents;
}

}  // namespace

std::vector<RenderedAgent> RenderSession(const SimOptions& options) {
  const Place place = BuildPlace(options.scenario, options.threads);
  const CapturePlan plan = PlanCaptures(options, place);
  std::vector<RenderedAgent> agents = MakeFolders(options);
  WriteWholeTruth(options, place, plan.cameras, plan.captures);
  ProgressBar progress("rendering", static_cast<int64_t>(plan.captures.size()));
  ParallelFor(static_cast<int>(plan.captures.size()), options.threads, [&](int i) {
    const Capture& capture = plan.captures[i];
    RenderToFile(options, place, plan.cameras[capture.camera], capture);
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
  std::string session, session_id, lcm_url, auth, rate;
  bool follow_advice = false;
  sim::RobotOptions robots;

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
  app->add_option(
         "--scenario", command->scenario,
         "Who walks where: see clients/README.md. video, blank and crowd are hard captures: blur "
         "and rolling shutter, painted walls, tourists' photos")
      ->check(CLI::IsMember(sim::ScenarioNames()))
      ->capture_default_str();
  app->add_option("--size", command->size, "Of the photos, WIDTHxHEIGHT")->capture_default_str();
  app->add_option("--focal-px", options.focal_px, "Focal length (0: 0.86 of the width)")
      ->check(AtLeastZero());
  app->add_option("--distortion", options.distortion, "k of COLMAP's SIMPLE_RADIAL")
      ->check(CLI::Range(-0.15, 0.15))
      ->capture_default_str();
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
  app->add_option("--auth", command->auth, "As of `skein agent`")->group(group);
  app->add_option("--rate", command->rate, "Photos a second of each agent")->group(group);
}

void AddRobotOptions(CLI::App* app, SimCommand* command) {
  const std::string group = "Robots (with a session whose guide runs)";
  app->add_flag("--follow-advice", command->follow_advice,
                "Each agent takes a few photos of its walk, then those that it is advised to take")
      ->group(group);
  app->add_option("--first-photos", command->robots.first_photos, "Of its walk")
      ->check(CLI::Range(2, 5000))
      ->capture_default_str()
      ->group(group);
  app->add_option("--max-photos", command->robots.max_photos, "Of each agent, in all")
      ->check(CLI::Range(2, 5000))
      ->capture_default_str()
      ->group(group);
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
  pass("--auth", command.auth);
  pass("--rate", command.rate);
  options.one_after_the_other = command.sim.scenario.scenario == sim::Scenario::kRelay;
  return options;
}

ClientOptions MakeClientOptions(const SimCommand& command) {
  ClientOptions options;
  options.session_dir = command.session;
  options.node.session_id = command.session_id;
  options.node.lcm_url = command.lcm_url;
  options.node.auth = command.auth;
  return options;
}

int FollowAdvice(const SimCommand& command) {
  constexpr double kLookS = 1;
  const sim::Place place = sim::BuildPlace(command.sim.scenario, command.sim.threads);
  const std::vector<sim::RenderedAgent> folders = sim::MakeFolders(command.sim);
  const auto node = MakeClientNode("sim", Role::kViewer, MakeClientOptions(command));
  WorkerThread renderer(node->loop());
  sim::Robots robots(
      *node, command.sim, command.robots, place,
      [&](const sim::Capture& capture, const sim::Camera& camera) {
        renderer.Run(
            [&, capture, camera] { sim::RenderToFile(command.sim, place, camera, capture); },
            [] {});
      });
  {
    const sim::WatchingAgents agents("/proc/self/exe", folders, MakePublishOptions(command));
    while (!robots.done() && !node->loop().interrupted()) {
      node->loop().RunUntil([&] { return robots.done(); }, kLookS);
    }
  }
  sim::WriteWholeTruth(command.sim, place, robots.cameras(), robots.taken());
  std::cout << robots.Summary();
  return robots.done() ? kExitOk : kExitError;
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
  AddRobotOptions(&app, &command);
  if (const auto code = ParseOptions(&app, argc, argv)) return *code;
  if (!ParseSize(command.size, &command.sim.width, &command.sim.height)) {
    std::cerr << "skein sim: --size takes WIDTHxHEIGHT between 64x64 and 8192x8192\n";
    return kExitUsage;
  }
  command.sim.scenario.scenario = *sim::ParseScenario(command.scenario);
  if (command.follow_advice) {
    if (!command.publishes() || command.scenario == "video" || command.scenario == "crowd") {
      std::cerr << "skein sim: --follow-advice takes --session or --session-id, and no scenario of "
                   "videos or tourists\n";
      return kExitUsage;
    }
    return FollowAdvice(command);
  }
  const std::vector<sim::RenderedAgent> agents = sim::RenderSession(command.sim);
  for (const sim::RenderedAgent& agent : agents) {
    std::cout << agent.name << " " << agent.folder << std::endl;
  }
  if (!command.publishes()) return kExitOk;
  return sim::PublishSession("/proc/self/exe", agents, MakePublishOptions(command));
}

}  // namespace skein
