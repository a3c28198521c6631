#include "config/option_section.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <set>

namespace skein {
namespace {

std::string OptionName(std::string key) {
  std::replace(key.begin(), key.end(), '_', '-');
  return "--" + key;
}

std::string KeyOf(const CLI::Option& option) {
  std::string key = option.get_single_name();
  std::replace(key.begin(), key.end(), '-', '_');
  return key;
}

bool IsFlag(const CLI::Option& option) { return option.get_expected_min() == 0; }

// Throws CLI::Error.
void SetOption(const ConfigEntry& entry, CLI::Option* option) {
  if (IsFlag(*option)) {
    const std::string value = entry.values.size() == 1 ? entry.values[0] : "";
    option->add_result(option->get_flag_value(OptionName(entry.key).substr(2), value));
  } else {
    option->add_result(entry.values);
  }
  option->run_callback();
}

Status ApplyEntry(const ConfigEntry& entry, CLI::App* app) {
  CLI::Option* option = app->get_option_no_throw(OptionName(entry.key));
  if (option == nullptr || !option->get_configurable()) {
    return InvalidArgument("there is no such key; `skein config` prints all");
  }
  if (option->count() > 0) return Status::Ok();  // the command line's
  try {
    SetOption(entry, option);
  } catch (const CLI::Error& error) {
    return InvalidArgument(error.what());
  }
  return Status::Ok();
}

std::string Quoted(const std::string& text) {
  const char quote = text.find('"') == std::string::npos ? '"' : '\'';
  return quote + text + quote;
}

// As TOML has it; "" of an option without a value. CLI11 2.3 writes an empty list as [], 2.4 as {}.
std::string ValueText(CLI::Option* option) {
  const std::string value = option->capture_default_str()->get_default_str();
  if (value.empty() || value == "[]" || value == "{}") return "";
  const bool is_text = option->get_type_name().rfind("TEXT", 0) == 0;
  return !is_text || value.front() == '[' ? value : Quoted(value);
}

std::string EntryText(CLI::Option* option, bool with_comments) {
  const std::string value = ValueText(option);
  std::string text;
  if (with_comments) text = "\n# " + option->get_description() + "\n";
  if (!value.empty()) return text + KeyOf(*option) + " = " + value + "\n";
  return with_comments ? text + "# " + KeyOf(*option) + " =\n" : "";
}

}  // namespace

CLI::Option* AddSwitch(CLI::App& app, const std::string& name, bool* value,
                       const std::string& help) {
  CLI::Option* option = app.add_flag("--" + name + ",!--no-" + name, *value, help);
  option->default_function([value] { return std::string(*value ? "true" : "false"); });
  return option->capture_default_str();
}

CLI::Option* AddChoice(CLI::App& app, const std::string& name,
                       const std::vector<std::string>& names,
                       const std::function<std::string()>& get,
                       const std::function<void(const std::string&)>& set,
                       const std::string& help) {
  CLI::Option* option = app.add_option_function<std::string>("--" + name, set, help);
  option->check(CLI::IsMember(names))->type_name("TEXT");
  option->default_function(get);
  return option->capture_default_str();
}

Status ApplySection(const ConfigFile& file, const std::string& section, CLI::App* app) {
  std::set<std::string> seen;
  for (const ConfigSection& part : file.sections) {
    if (part.name != section) continue;
    for (const ConfigEntry& entry : part.entries) {
      const std::string where = file.path + ": [" + section + "] " + entry.key + ": ";
      if (!seen.insert(entry.key).second) return InvalidArgument(where + "stands there twice");
      const Status status = ApplyEntry(entry, app);
      if (!status.ok()) return InvalidArgument(where + status.error());
    }
  }
  return Status::Ok();
}

std::string SectionText(const std::string& section, CLI::App* app, bool with_comments) {
  std::string text = "[" + section + "]\n";
  for (CLI::Option* option : app->get_options()) {
    if (option->get_configurable()) text += EntryText(option, with_comments);
  }
  return text;
}

}  // namespace skein
