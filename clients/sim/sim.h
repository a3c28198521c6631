// `skein sim`: simulated agents photograph a synthetic place.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "clients/sim/scenario.h"

namespace skein::sim {

struct SimOptions {
  ScenarioOptions scenario;
  std::string out;
  int width = 1280, height = 960;
  double focal_px = 0;  // 0: 0.86 of the width
  double distortion = -0.05;
  int quality = 95;
  bool exif = true;
  bool gps = false;
  int threads = 1;
};

// Renders OUT/images/AGENT/NAME.jpg and OUT/truth; returns each agent's folder. A photo is complete
// when its name appears. Throws std::runtime_error when a file cannot be written.
struct RenderedAgent {
  std::string name, folder;
};
std::vector<RenderedAgent> RenderSession(const SimOptions& options);

}  // namespace skein::sim

namespace skein {

int RunSim(int argc, char** argv);

}  // namespace skein
