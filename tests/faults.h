// Faults of a service's steps, for process tests, as SKEIN_TEST_FAULTS says: words PREFIX=throw,
// PREFIX=crash or PREFIX=kill, separated by commas.
#pragma once

#include <csignal>
#include <cstdlib>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>

#include "event_loop/step_record.h"
#include "node/service_options.h"

namespace skein {

inline std::map<std::string, std::string> FaultsOf(const char* text) {
  std::map<std::string, std::string> faults;
  std::istringstream words(text == nullptr ? "" : text);
  for (std::string word; std::getline(words, word, ',');) {
    const size_t end = word.find('=');
    if (end == std::string::npos) throw std::invalid_argument("SKEIN_TEST_FAULTS: " + word);
    faults[word.substr(0, end)] = word.substr(end + 1);
  }
  return faults;
}

// A step fails at each try if "NAME ITEM" begins with the prefix.
inline void InjectFaults(StepRecord* steps) {
  steps->OnBegin([faults = FaultsOf(std::getenv("SKEIN_TEST_FAULTS"))](const Step& step) {
    const std::string name = step.name + " " + std::to_string(step.item);
    for (const auto& [prefix, fault] : faults) {
      if (name.rfind(prefix, 0) != 0) continue;
      if (fault == "throw") throw std::runtime_error("injected into " + name);
      std::raise(fault == "crash" ? SIGSEGV : SIGKILL);
    }
  });
}

// main of a service with faults. run(node, options) makes the service and runs the node.
template <class Options, class Run>
int RunWithFaults(const std::string& service, int argc, char** argv, const Run& run) {
  NodeOptions node_options;
  node_options.service = service;
  Options options;
  const std::string about = "skein-" + service + " with faults.";
  if (const auto code = ParseServiceOptions(about.c_str(), argc, argv, &node_options, &options)) {
    return *code;
  }
  return RunService(node_options, [&](Node& node) {
    InjectFaults(&node.steps());
    run(node, options);
  });
}

}  // namespace skein
