#include "clients/demand.h"

#include <CLI/CLI.hpp>
#include <iostream>
#include <string>

#include "clients/client_node.h"
#include "clients/subcommand.h"
#include "core/clock.h"
#include "core/counted.h"
#include "node/demand.h"

namespace skein {
namespace {

constexpr char kKind[] = "submap";
constexpr double kLookS = 0.1;

// Prints a line, which launch.sh reads, whenever the shortage or the mappers change.
class DemandWatch {
 public:
  explicit DemandWatch(Node& node) : book_(kKind) {
    node.bus().Subscribe<demand_t>(
        kDemandChannel, [this](const demand_t& demand) { book_.OnDemand(demand, MonotonicS()); });
    node.bus().Subscribe<work_request_t>(
        kWorkRequestChannel,
        [this](const work_request_t& request) { book_.OnRequest(request, MonotonicS()); });
    node.loop().AddTimer(kLookS, [this] { Print(); });
    node.OnHeartbeat([this](heartbeat_t* heartbeat) {
      heartbeat->state = MappersWanted(book_.NumShort(MonotonicS()));
    });
  }

 private:
  void Print() {
    std::string line = "short " + std::to_string(book_.NumShort(MonotonicS())) + " of";
    for (const std::string& worker : book_.Workers(MonotonicS())) line += " " + worker;
    if (line == line_) return;
    line_ = line;
    std::cout << line_ << std::endl;
  }

  DemandBook book_;
  std::string line_;
};

}  // namespace

std::string MappersWanted(int num_short) {
  if (num_short <= 0) return "enough mappers";
  return Counted(num_short, "more mapper") + " wanted";
}

int RunDemand(int argc, char** argv) {
  ClientOptions options;
  CLI::App app(
      "Tells how many more mappers a session could use, whenever that changes:\n"
      "\"short N of MAPPER MAPPER ...\", the mappers being those that are heard.",
      "skein demand");
  AddClientOptions(app, &options);
  app.add_option("--instance", options.node.instance,
                 "Name of this process, unique in the session");
  if (const auto exit_code = ParseOptions(&app, argc, argv)) return *exit_code;
  const auto node = MakeClientNode("demand", Role::kViewer, options);
  DemandWatch watch(*node);
  node->Run();
  return kExitOk;
}

}  // namespace skein
