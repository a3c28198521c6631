#pragma once

#include <string>
#include <vector>

namespace skein {

// A QR code of the text in half blocks of UTF-8, two rows of modules a line, light on dark. Throws
// std::runtime_error for a text that is too long (2,953 bytes).
std::string QrCode(const std::string& text);

// The same as rows of modules, '1' for a dark one, without a quiet zone.
std::vector<std::string> QrModules(const std::string& text);

}  // namespace skein
