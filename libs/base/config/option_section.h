// A process's options on the command line and in its section of a config file. An option is bound
// once, to a field of the options struct, with CLI11. "--max-features" is max_features in the file.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "config/config_file.h"
#include "core/result.h"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace skein {

// On or off: --NAME and --no-NAME, NAME = true or false in a file.
CLI::Option* AddSwitch(CLI::App& app, const std::string& name, bool* value,
                       const std::string& help);

// One of `names`.
CLI::Option* AddChoice(CLI::App& app, const std::string& name,
                       const std::vector<std::string>& names,
                       const std::function<std::string()>& get,
                       const std::function<void(const std::string&)>& set, const std::string& help);

// Sets each option that the command line did not set to its value in the file's sections of that
// name. Error: a key or value that no option takes; the text names file, section and key.
Status ApplySection(const ConfigFile& file, const std::string& section, CLI::App* app);

// "[SECTION]" and a line "key = value" for each option. With comments it also explains each, and
// lists options without a value as comments. Reads back as it was written.
std::string SectionText(const std::string& section, CLI::App* app, bool with_comments);

}  // namespace skein
