// The file of all services' options: TOML, a section a service.
//
//   [features]
//   max_features = 8192
//
// Keys are the names of command line options, with '_' for '-'. `skein config` prints the whole.
#pragma once

#include <string>
#include <vector>

#include "core/result.h"

namespace skein {

struct ConfigEntry {
  std::string key;
  std::vector<std::string> values;  // several of an array
};

struct ConfigSection {
  std::string name;
  std::vector<ConfigEntry> entries;
};

struct ConfigFile {
  std::string path;
  std::vector<ConfigSection> sections;  // in the order of the file; [[NAME]]: one each time
};

// An error names the file and what to change: an unreadable file, an unknown section, a key outside
// all sections.
Result<ConfigFile> ReadConfigFile(const std::string& path);

// Parses `text`; `path` is for messages.
Result<ConfigFile> ParseConfigFile(const std::string& text, const std::string& path);

}  // namespace skein
