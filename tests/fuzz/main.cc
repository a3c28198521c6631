// The program of all targets runs the target that it is called by: fuzz_TARGET is a link to it.
#include <algorithm>
#include <map>

#include "fuzz/fuzz.h"

namespace skein::fuzz {
namespace {

using Targets = std::map<std::string, TargetFunction>;

Targets& AllTargets() {
  static Targets targets;
  return targets;
}

TargetFunction chosen = nullptr;

}  // namespace

bool AddTarget(const char* name, TargetFunction function) {
  return AllTargets().emplace(name, function).second;
}

}  // namespace skein::fuzz

extern "C" int LLVMFuzzerInitialize(int*, char*** argv) {
  using namespace skein::fuzz;
  const std::string prefix = "fuzz_", name = std::filesystem::path(**argv).filename().string();
  const auto target = AllTargets().find(name.substr(std::min(prefix.size(), name.size())));
  Expect(target != AllTargets().end(), "the program is called by a target's name");
  chosen = target->second;
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  skein::fuzz::chosen(data, size);
  return 0;
}
