// Logging through spdlog, to stderr: stdout belongs to a program's results.
#pragma once

#include <string>

namespace skein {

// Makes spdlog's default logger write "time service level text" to stderr. Call once, in main.
void InitLog(const std::string& service, bool verbose);

}  // namespace skein
