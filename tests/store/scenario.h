// What store_scenario and its tests agree on.
#pragma once

#include <string>

#include "core/bytes.h"

namespace skein::store_test {

constexpr int kNumPhotos = 4;

// Before each line that the scenario acknowledges something with: the log is printed, too.
const std::string kAcknowledged = "acknowledged: ";

inline std::string NameOf(int number) { return "folder/" + std::to_string(number) + ".jpg"; }

// No photo: nothing here looks into it. Of several pages, so that it can be torn.
inline Bytes PhotoOf(int number) {
  const std::string line = "photo " + std::to_string(number) + "\n";
  Bytes bytes;
  while (bytes.size() < 9000) bytes.insert(bytes.end(), line.begin(), line.end());
  return bytes;
}

}  // namespace skein::store_test
