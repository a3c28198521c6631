#include "config/finite.h"

#include <CLI/CLI.hpp>
#include <cmath>

namespace skein {

std::string NotFinite(const CLI::App& app) {
  for (const CLI::Option* option : app.get_options()) {
    if (option->get_type_name().find("FLOAT") == std::string::npos) continue;
    for (const std::string& text : option->reduced_results()) {
      double value = 0;
      if (CLI::detail::lexical_cast(text, value) && !std::isfinite(value)) {
        return option->get_name() + " is " + text + ": give a number";
      }
    }
  }
  return "";
}

}  // namespace skein
