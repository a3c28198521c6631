#pragma once

#include <functional>
#include <optional>
#include <string>

#include "config/config_file.h"
#include "core/result.h"

namespace CLI {
class App;
}

namespace skein {

// A process that has a section in the config file.
struct Program {
  std::string section;                         // the service's name
  std::string description;                     // one line, for --help
  std::string version;                         // for --version; "": there is no such option
  std::function<void(CLI::App&)> add_options;  // options of the section
  // Options that say where the process runs; the file has none of them. May be unset.
  std::function<void(CLI::App&)> add_place_options;
  // Reads further sections; may be unset.
  std::function<Status(const ConfigFile&)> read_more;
  // Its text, as comments tell it: with_comments; may be unset.
  std::function<std::string(bool with_comments)> print_more;
  std::function<Status()> check;  // whether the values make sense together
};

// Parses the command line over --config FILE over the defaults. Returns the exit code if the
// program ends now: 0 after --help, --version and --print-config, 2 for bad usage, explained by one
// line on stderr. `configuration` becomes the section as it is now, without comments.
std::optional<int> ParseProgramOptions(const Program& program, int argc, char** argv,
                                       std::string* configuration);

}  // namespace skein
