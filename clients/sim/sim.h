// `skein sim`: simulated agents photograph a synthetic place.
#pragma once

#include <string>
#include <vector>

#include "clients/sim/capture.h"

namespace skein::sim {

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
