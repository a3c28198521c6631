#include "merger/merger_options.h"

#include <CLI/CLI.hpp>

#include "config/option_section.h"
#include "core/option_check.h"

namespace skein {

Status MergerOptions::Check() const {
  return InRange("wait_for_mapper", wait_for_mapper_s, 0.0, 3600.0);
}

void AddOptions(CLI::App& app, MergerOptions* options) {
  AddSwitch(app, "merge", &options->merge,
            "Join submaps that overlap; off: leave them apart, for comparison");
  app.add_option("--wait-for-mapper", options->wait_for_mapper_s,
                 "Seconds that a finish waits for a mapper that could take a seed");
}

}  // namespace skein
