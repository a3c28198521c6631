#pragma once

#include <optional>
#include <ostream>

#include "node/node.h"

namespace skein {

// Repeats the command, once a second, until ingest answers it; nullopt if that took longer than
// timeout_s (0: no limit) or a signal came. Tells what ingest says it does, whenever that changes,
// and that nothing is heard of it. Loop's thread, which it runs.
std::optional<command_reply_t> AskToFinish(Node& node, double timeout_s, std::ostream& progress_to);

// `skein finish`: asks ingest to finish the session, and waits for its models.
int RunFinish(int argc, char** argv);

}  // namespace skein
