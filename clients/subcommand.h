// Common parts of subcommands: their row in main.cc's table, exit codes, parsing of options.
#pragma once

#include <CLI/CLI.hpp>
#include <iostream>
#include <optional>

#include "config/finite.h"
#include "config/usage.h"

namespace skein {

// Exit codes of every subcommand.
enum ExitCode : int {
  kExitOk = 0,
  kExitError = 1,  // the command was understood and could not be carried out; one line on stderr
                   // says why
  kExitUsage = 2,  // bad option or argument; one line on stderr says what to do
};

struct Subcommand {
  const char* name;
  const char* help;                   // one line
  int (*run)(int argc, char** argv);  // argv[0] is the subcommand's name; may throw std::exception
};

// Parses `argc`/`argv` with `app`. Empty: go on. Otherwise the code to exit with; help or one line
// with the reason has been printed. A footer that the app lacks tells the exit codes above.
inline std::optional<int> ParseOptions(CLI::App* app, int argc, char** argv) {
  if (app->get_footer().empty()) app->footer("Exit codes: 0 done, 1 error, 2 bad usage.");
  try {
    app->parse(argc, argv);
  } catch (const CLI::Success& success) {
    return app->exit(success);
  } catch (const CLI::ParseError& error) {
    std::cerr << "skein " << argv[0] << ": " << UsageError(*app, error)
              << " (--help tells the options)" << std::endl;
    return kExitUsage;
  }
  if (const std::string not_finite = NotFinite(*app); !not_finite.empty()) {
    std::cerr << "skein " << argv[0] << ": " << not_finite << std::endl;
    return kExitUsage;
  }
  return std::nullopt;
}

}  // namespace skein
