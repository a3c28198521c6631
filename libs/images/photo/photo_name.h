#pragma once

#include <string>

#include "core/result.h"

// Names come from anyone on the network and become paths.
namespace skein {

constexpr size_t kMaxAgentBytes = 64;
constexpr size_t kMaxNameBytes = 255;

// An agent's name is one path component: 1..64 bytes of UTF-8. Forbidden are '/' and '\', a dot at
// the start, and control characters, to which those of bidirectional text belong.
Status CheckAgentName(const std::string& agent);

// A photo's name is a relative path: 1..255 bytes of UTF-8. Forbidden are control characters, and
// an empty, "." or ".." component." or ".." component.
Status CheckPhotoName(const std::string& name);

// Text for a log or a terminal: bytes that are not UTF-8 and control characters become '?', cut to
// max_bytes.
std::string Printable(const std::string& text, size_t max_bytes = 100);

// "a/b.jpg", 2 -> "a/b~2.jpg": the name of another photo that came under a name already taken.
// Shortens the stem where the result would pass kMaxNameBytes.
std::string NumberedName(const std::string& name, int number);

}  // namespace skein
