#pragma once

#include <optional>
#include <ostream>

#include "node/node.h"

namespace skein {

// Repeats the command once a second until ingest answers it. nullopt after timeout_s (0: no limit)
// or a signal. Prints ingest's progress when it changes, and when ingest is silent. Ingest leaves
// out what is left after within_s (0: nothing). Runs the loop, on its thread.
std::optional<command_reply_t> AskToFinish(Node& node, double timeout_s, std::ostream& progress_to,
                                           double within_s = 0);

// `skein finish`: asks ingest to finish the session, and waits for its models.
int RunFinish(int argc, char** argv);

}  // namespace skein
