#include "merger/merger_options.h"

#include <CLI/CLI.hpp>

#include "config/option_section.h"

namespace skein {

void AddOptions(CLI::App& app, MergerOptions* options) {
  AddSwitch(app, "merge", &options->merge,
            "Join submaps that overlap; off: leave them apart, for comparison");
}

}  // namespace skein
