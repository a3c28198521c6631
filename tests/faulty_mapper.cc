// skein-mapper whose steps fail as SKEIN_TEST_FAULTS says: words PREFIX=throw, PREFIX=crash or
// PREFIX=kill, separated by commas. A step whose name begins with the prefix fails at each try.
#include <csignal>
#include <cstdlib>
#include <map>
#include <sstream>
#include <stdexcept>

#include "mapper/mapper_options.h"
#include "mapper/mapper_service.h"
#include "node/service_options.h"

namespace skein {
namespace {

std::map<std::string, std::string> FaultsOf(const char* text) {
  std::map<std::string, std::string> faults;
  std::istringstream words(text == nullptr ? "" : text);
  for (std::string word; std::getline(words, word, ',');) {
    const size_t end = word.find('=');
    if (end == std::string::npos) throw std::invalid_argument("SKEIN_TEST_FAULTS: " + word);
    faults[word.substr(0, end)] = word.substr(end + 1);
  }
  return faults;
}

void FailStep(const std::map<std::string, std::string>& faults, const Step& step) {
  for (const auto& [prefix, fault] : faults) {
    if (step.name.rfind(prefix, 0) != 0) continue;
    if (fault == "throw") throw std::runtime_error("injected into " + step.name);
    std::raise(fault == "crash" ? SIGSEGV : SIGKILL);
  }
}

}  // namespace
}  // namespace skein

int main(int argc, char** argv) {
  skein::NodeOptions node_options;
  node_options.service = "mapper";
  skein::MapperOptions options;
  if (const auto code = skein::ParseServiceOptions("A mapper with faults.", argc, argv,
                                                   &node_options, &options)) {
    return *code;
  }
  options.run.submap.make_local = skein::MakerOf(options.local_ba);
  return skein::RunService(node_options, [&](skein::Node& node) {
    node.steps().OnBegin([faults = skein::FaultsOf(std::getenv("SKEIN_TEST_FAULTS"))](
                             const skein::Step& step) { skein::FailStep(faults, step); });
    skein::MapperService service(node, options.run, options.retire_after_s);
    node.Run();
  });
}
