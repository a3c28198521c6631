#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "skein/heartbeat_t.hpp"

namespace skein {

// A process as it was last heard.
struct HeardProcess {
  heartbeat_t heartbeat;
  double heard_s = 0;          // monotonic
  int64_t clock_ahead_us = 0;  // of the hearer's, when it was heard
};
using HeardProcesses = std::map<std::string, HeardProcess>;  // by instance

}  // namespace skein
