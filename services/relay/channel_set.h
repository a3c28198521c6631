// The channels that a client has subscribed to.
#pragma once

#include <cstddef>
#include <map>
#include <string>

namespace skein {

// LCM has regular expressions here. Their cost has no bound that a relay could bear, so three forms
// are taken: a channel's name, PREFIX.*, and .* alone.
class ChannelSet {
 public:
  static constexpr size_t kMaxBytes = 128;    // of a subscription
  static constexpr size_t kMaxNames = 256;    // of a client, different ones
  static constexpr size_t kMaxPrefixes = 16;  // each is held against each message

  // Null if it is taken, else why not. A pattern that is added twice has to be removed twice.
  const char* Add(const std::string& pattern);
  // No effect if it is not there.
  void Remove(const std::string& pattern);
  bool Matches(const std::string& channel) const;

 private:
  std::map<std::string, int> names_;
  std::map<std::string, int> prefixes_;
};

}  // namespace skein
