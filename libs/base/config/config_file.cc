#include "config/config_file.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <sstream>

#include "core/file.h"

namespace skein {
namespace {

// Every section that some process reads.
constexpr std::array<const char*, 11> kSections = {"ingest",   "cameras", "features", "retrieval",
                                                   "matching", "mapper",  "merger",   "guide",
                                                   "dense",    "relay",   "web"};
constexpr size_t kMaxBytes = 1 << 20;
constexpr char kSectionBegin[] = "++";  // as CLI11 marks them
constexpr char kSectionEnd[] = "--";

Status CheckSection(const std::string& name) {
  if (std::find(kSections.begin(), kSections.end(), name) != kSections.end()) return Status::Ok();
  std::string known;
  for (const char* section : kSections) known += std::string(known.empty() ? "" : ", ") + section;
  return InvalidArgument("there is no section [" + name + "]; sections are " + known);
}

Status AddItem(const CLI::ConfigItem& item, ConfigFile* file) {
  const std::string section = CLI::detail::join(item.parents, ".");
  if (item.name == kSectionEnd) return Status::Ok();
  if (item.name == kSectionBegin) {
    file->sections.push_back({section, {}});
    return CheckSection(section);
  }
  if (section.empty()) {
    return InvalidArgument("\"" + item.name +
                           "\" stands outside all sections; write [SERVICE] above");
  }
  if (file->sections.empty() || file->sections.back().name != section) {
    return InvalidArgument("\"" + item.fullname() + "\": write keys without dots");
  }
  file->sections.back().entries.push_back({item.name, item.inputs});
  return Status::Ok();
}

}  // namespace

Result<ConfigFile> ParseConfigFile(const std::string& text, const std::string& path) {
  std::istringstream stream(text);
  std::vector<CLI::ConfigItem> items;
  try {
    items = CLI::ConfigTOML().from_config(stream);
  } catch (const CLI::Error& error) {
    // CLI11 2.4 throws for an escape sequence that it does not know.
    return InvalidArgument(path + ": " + error.what());
  }
  ConfigFile file{path, {}};
  for (const CLI::ConfigItem& item : items) {
    const Status status = AddItem(item, &file);
    if (!status.ok()) return InvalidArgument(path + ": " + status.error());
  }
  return file;
}

Result<ConfigFile> ReadConfigFile(const std::string& path) {
  const auto bytes = ReadFile(path, kMaxBytes);
  if (!bytes) return InvalidArgument("--config: " + bytes.error());
  return ParseConfigFile({bytes->begin(), bytes->end()}, path);
}

}  // namespace skein
