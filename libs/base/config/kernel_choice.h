// Option for the instruction set of a process's inner loops.
#pragma once

#include <string>
#include <vector>

#include "config/option_section.h"

namespace skein {

// --kernel NAME: one of `versions` by `name_of`, or "fastest". The version that is fastest on this
// processor is printed as "fastest", so that a file of options serves on other hosts, too.
template <typename Versions, typename Version>
void AddKernelChoice(CLI::App& app, const Versions& versions, std::string (*name_of)(Version),
                     Version fastest, Version* kernel, const std::string& help) {
  const std::string fastest_name = "fastest";
  std::vector<std::string> names = {fastest_name};
  for (const Version version : versions) names.push_back(name_of(version));
  const auto get = [=] { return *kernel == fastest ? fastest_name : name_of(*kernel); };
  const auto set = [=](const std::string& name) {
    *kernel = fastest;
    for (const Version version : versions) {
      if (name_of(version) == name) *kernel = version;
    }
  };
  AddChoice(app, "kernel", names, get, set, help);
}

}  // namespace skein
