#include "features/idle_cores.h"

#include <algorithm>
#include <fstream>
#include <sstream>
#include <thread>

namespace skein {

int ThreadsForIdleCores(const std::string& loadavg, int cores, int most) {
  std::istringstream fields(loadavg);
  std::string average;
  int running = 0;
  if (!(fields >> average >> average >> average >> running)) return most;
  return std::clamp(cores - running + 1, 1, std::max(1, most));
}

int ThreadsForIdleCores(int most) {
  std::string line;
  std::ifstream file("/proc/loadavg");
  std::getline(file, line);
  return ThreadsForIdleCores(line, static_cast<int>(std::thread::hardware_concurrency()), most);
}

}  // namespace skein
