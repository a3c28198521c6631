// The options of a service: those of every node, and its own section of the config file.
#pragma once

#include <optional>

#include "config/program_options.h"
#include "core/version.h"
#include "node/node.h"

namespace skein {

// A program with the options of every node.
Program ServiceProgram(const char* description, NodeOptions* node);

// For an Options with `Status Check() const` and `void AddOptions(CLI::App&, Options*)` beside it.
// The exit code, if the program is to end now; node->configuration says what it runs with.
template <class Options>
std::optional<int> ParseServiceOptions(const char* description, int argc, char** argv,
                                       NodeOptions* node, Options* options) {
  Program program = ServiceProgram(description, node);
  program.version = VersionWithCommit();
  program.add_options = [options](CLI::App& app) { AddOptions(app, options); };
  program.check = [options] { return options->Check(); };
  return ParseProgramOptions(program, argc, argv, &node->configuration);
}

// The main function of a service that is made of a node and its options alone.
template <class Service, class Options>
int RunServiceWithOptions(NodeOptions node_options, const char* description, int argc,
                          char** argv) {
  Options options;
  const auto code = ParseServiceOptions(description, argc, argv, &node_options, &options);
  if (code) return *code;
  return RunService(node_options, [&](Node& node) {
    Service service(node, options);
    node.Run();
  });
}

}  // namespace skein
