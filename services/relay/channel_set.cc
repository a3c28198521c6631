#include "relay/channel_set.h"

#include <algorithm>

namespace skein {
namespace {

constexpr char kRest[] = ".*";
constexpr char kSpecial[] = ".[]{}()\\*+?|^$";  // in a POSIX extended regular expression

bool BeginsWith(const std::string& text, const std::string& beginning) {
  return text.compare(0, beginning.size(), beginning) == 0;
}

// Cuts ".*" off the end; false if there is none.
bool CutRest(std::string* pattern) {
  const size_t rest = sizeof(kRest) - 1;
  if (pattern->size() < rest || pattern->compare(pattern->size() - rest, rest, kRest) != 0) {
    return false;
  }
  pattern->resize(pattern->size() - rest);
  return true;
}

}  // namespace

const char* ChannelSet::Add(const std::string& pattern) {
  if (pattern.size() > kMaxBytes) return "it has more than 128 bytes";
  std::string name = pattern;
  const bool is_prefix = CutRest(&name);
  auto& place = is_prefix ? prefixes_ : names_;
  if (name.find_first_of(kSpecial) != std::string::npos) {
    return "give a channel's name, PREFIX.* or .*; this relay takes no other regular expression";
  }
  if (place.size() >= (is_prefix ? kMaxPrefixes : kMaxNames) && place.count(name) == 0) {
    return is_prefix ? "it has 16 prefixes already; subscribe .*"
                     : "it has 256 names already; subscribe PREFIX.* or .*";
  }
  ++place[name];
  return nullptr;
}

void ChannelSet::Remove(const std::string& pattern) {
  std::string name = pattern;
  auto& place = CutRest(&name) ? prefixes_ : names_;
  const auto found = place.find(name);
  if (found != place.end() && --found->second == 0) place.erase(found);
}

bool ChannelSet::Matches(const std::string& channel) const {
  if (names_.count(channel) != 0) return true;
  return std::any_of(prefixes_.begin(), prefixes_.end(),
                     [&](const auto& prefix) { return BeginsWith(channel, prefix.first); });
}

}  // namespace skein
