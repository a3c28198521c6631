#pragma once

#include <string>

namespace skein {

// Control characters (C0, DEL, C1) as "\\xNN": a text that holds names that others chose stays one
// line, and does nothing to a terminal.
std::string OneLine(const std::string& text);

}  // namespace skein
