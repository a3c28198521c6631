// How the session goes, for the page: what is no event.
#pragma once

#include <map>
#include <string>

#include "session/heard_processes.h"
#include "session/session_history.h"
#include "session/troubles.h"

namespace skein {

// Latest messages of the guide, for submaps that have ended, too.
struct HeardGuidance {
  std::map<int64_t, guidance_t> places;    // by submap
  std::map<std::string, advice_t> advice;  // by agent
};

// {"type":"status", ...}, see services/web/README.md. Costs the number of photos.
std::string StatusMessage(const SessionRecord& session, const HeardProcesses& processes,
                          double now_s, const std::vector<Trouble>& troubles,
                          const HeardGuidance& guidance = {});

}  // namespace skein
