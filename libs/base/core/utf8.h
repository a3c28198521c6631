#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace skein {

// Length of the valid UTF-8 sequence at `at`; 0 for overlong forms, surrogates and values beyond
// U+10FFFF. RFC 3629.
size_t Utf8Length(std::string_view text, size_t at);

bool IsUtf8(std::string_view text);

// The text with its ASCII letters in lower case.
std::string LowerCase(std::string text);

}  // namespace skein
