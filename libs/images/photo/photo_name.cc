#include "photo/photo_name.h"

#include <algorithm>

#include "core/utf8.h"

namespace skein {
namespace {

// Of the valid sequence at `at`, of `length` bytes.
char32_t CodePoint(const std::string& text, size_t at, size_t length) {
  const auto byte = [&](size_t i) { return static_cast<unsigned char>(text[at + i]); };
  char32_t code = length == 1 ? byte(0) : byte(0) & (0x7fu >> length);
  for (size_t i = 1; i < length; ++i) code = code << 6 | (byte(i) & 0x3fu);
  return code;
}

// What a terminal acts on instead of showing it (Unicode's category Cc), and what makes the text
// around it look like another: separators of lines, and the embeddings, overrides and isolates of
// the bidirectional algorithm (UAX #9).
bool IsControl(char32_t code) {
  const auto in = [code](char32_t first, char32_t last) { return first <= code && code <= last; };
  return code < 0x20 || in(0x7f, 0x9f) || in(0x2028, 0x202e) || in(0x2066, 0x2069);
}

bool HoldsControls(const std::string& text) {
  for (size_t at = 0; at < text.size();) {
    const size_t length = Utf8Length(text, at);
    if (length > 0 && IsControl(CodePoint(text, at, length))) return true;
    at += std::max<size_t>(length, 1);
  }
  return false;
}

Status CheckText(const std::string& text, const std::string& what, size_t max_bytes) {
  if (text.empty()) return InvalidArgument(what + " is empty");
  if (text.size() > max_bytes) {
    return InvalidArgument(what + " has " + std::to_string(text.size()) + " bytes, more than " +
                           std::to_string(max_bytes));
  }
  if (HoldsControls(text)) return InvalidArgument(what + " holds control characters");
  if (!IsUtf8(text)) return InvalidArgument(what + " is not valid UTF-8");
  return Status::Ok();
}

}  // namespace

Status CheckAgentName(const std::string& agent) {
  if (Status status = CheckText(agent, "agent's name", kMaxAgentBytes); !status.ok()) return status;
  if (agent.find_first_of("/\\") != std::string::npos) {
    return InvalidArgument("agent's name holds a slash");
  }
  if (agent[0] == '.') return InvalidArgument("agent's name starts with a dot");
  return Status::Ok();
}

Status CheckPhotoName(const std::string& name) {
  if (Status status = CheckText(name, "name", kMaxNameBytes); !status.ok()) return status;
  if (name[0] == '/') return InvalidArgument("name is an absolute path");
  for (size_t begin = 0; begin <= name.size();) {
    const size_t end = std::min(name.find('/', begin), name.size());
    const std::string part = name.substr(begin, end - begin);
    if (part == "..") return InvalidArgument("name leaves its folder (\"..\")");
    if (part.empty() || part == ".") return InvalidArgument("name has an empty path component");
    begin = end + 1;
  }
  return Status::Ok();
}

std::string Printable(const std::string& text, size_t max_bytes) {
  std::string printable;
  for (size_t at = 0; at < text.size();) {
    const size_t length = Utf8Length(text, at);
    const bool shown = length > 0 && !IsControl(CodePoint(text, at, length));
    const std::string piece = shown ? text.substr(at, length) : "?";
    if (printable.size() + piece.size() > max_bytes) return printable + "...";
    printable += piece;
    at += std::max<size_t>(length, 1);
  }
  return printable;
}

std::string NumberedName(const std::string& name, int number) {
  const size_t slash = name.rfind('/');
  const size_t begin = slash == std::string::npos ? 0 : slash + 1;
  size_t dot = name.rfind('.');
  if (dot == std::string::npos || dot <= begin) dot = name.size();
  const std::string tail = "~" + std::to_string(number) + name.substr(dot);
  if (tail.size() + begin >= kMaxNameBytes) return name.substr(0, begin) + tail.substr(0, 16);
  size_t stem = std::min(dot, kMaxNameBytes - tail.size());
  while (stem > begin && (static_cast<unsigned char>(name[stem]) & 0xc0) == 0x80) --stem;
  return name.substr(0, stem) + tail;
}

}  // namespace skein
