#include "clients/finish.h"

#include <CLI/CLI.hpp>
#include <iostream>
#include <map>
#include <optional>
#include <string>

#include "clients/client_node.h"
#include "clients/ingest_watch.h"
#include "clients/subcommand.h"
#include "core/clock.h"
#include "core/counted.h"
#include "core/process.h"

namespace skein {
namespace {

constexpr double kRepeatS = 1;

struct FinishOptions {
  ClientOptions client;
  double timeout_s = 0;
  double within_s = 0;
};

std::optional<int> ParseFinishOptions(int argc, char** argv, FinishOptions* options) {
  CLI::App app(
      "Finishes a session: waits for all photos, refines and writes sparse/ and report.json.\n"
      "The session stays open: photos can be added and it can be finished again.\n"
      "--within gives the best map there is by then: what is left is left out, and told.",
      "skein finish");
  AddClientOptions(app, &options->client);
  app.add_option("--timeout", options->timeout_s, "Seconds to wait (default: as long as it takes)")
      ->check(AtLeastZero());
  app.add_option(
         "--within", options->within_s,
         "Seconds after which photos in work, merges and adjustments are left out; only the "
         "models are written then. On a finish that runs: an earlier deadline")
      ->check(AboveZero());
  app.footer("Exit codes: 0 finished, 1 error, timeout or interrupted, 2 bad usage.");
  return ParseOptions(&app, argc, argv);
}

// Says what ingest does and what the submaps do meanwhile, whenever that changes, and that ingest
// is silent.
class ProgressTeller {
 public:
  ProgressTeller(Node& node, std::ostream& out) : node_(node), out_(out), ingest_(node) {}

  void OnHeartbeat(const heartbeat_t& heartbeat) {
    if (heartbeat.service != "ingest") return;
    Tell(heartbeat.state + Submaps());
  }
  void OnSubmap(const submap_status_t& status) {
    submaps_[status.submap_id] = {MonotonicS(), status.num_images, status.detail};
  }
  void Tick() {
    if (ingest_.is_silent()) Tell(NoSignOfIngest(node_) + " Waiting for it");
  }

 private:
  void Tell(const std::string& text) {
    if (text == told_) return;
    told_ = text;
    const int seconds = static_cast<int>(MonotonicS() - start_s_);
    out_ << "[" << seconds << " s] " << text << std::endl;
  }

  struct Submap {
    double heard_s;
    int num_images;
    std::string detail;
  };

  // "; map 3 (120 photos): consolidates, about 8 s" for each that is at something.
  std::string Submaps() const {
    std::string text;
    for (const auto& [id, submap] : submaps_) {
      if (submap.detail.empty() || MonotonicS() - submap.heard_s > kIngestSilentS) continue;
      text += "; map " + std::to_string(id) + " (" + Counted(submap.num_images, "photo") +
              "): " + submap.detail;
    }
    return text;
  }

  Node& node_;
  std::ostream& out_;
  IngestWatch ingest_;
  std::map<int64_t, Submap> submaps_;
  const double start_s_ = MonotonicS();
  std::string told_;
};

}  // namespace

std::optional<command_reply_t> AskToFinish(Node& node, double timeout_s, std::ostream& progress_to,
                                           double within_s) {
  command_t command{};
  command.command_id = static_cast<int64_t>(RandomU64() >> 1);
  command.sender = node.instance();
  command.verb = "finish";
  if (within_s > 0) command.argument = std::to_string(within_s);
  std::optional<command_reply_t> answer;
  ProgressTeller progress(node, progress_to);
  const auto replies = node.bus().Subscribe<command_reply_t>(
      kCommandReplyChannel, [&](const command_reply_t& reply) {
        if (reply.command_id == command.command_id) answer = reply;
      });
  const auto heartbeats = node.bus().Subscribe<heartbeat_t>(
      kHeartbeatChannel, [&](const heartbeat_t& heartbeat) { progress.OnHeartbeat(heartbeat); });
  const auto submaps = node.bus().Subscribe<submap_status_t>(
      kSubmapStatusChannel, [&](const submap_status_t& status) { progress.OnSubmap(status); });
  const double start_s = MonotonicS();
  const auto in_time = [&] { return timeout_s <= 0 || MonotonicS() - start_s < timeout_s; };
  while (!answer && in_time() && !node.loop().interrupted()) {
    node.Publish(kCommandChannel, command);
    progress.Tick();
    node.loop().RunUntil([&] { return answer.has_value(); }, kRepeatS);
  }
  node.bus().Unsubscribe(replies);
  node.bus().Unsubscribe(heartbeats);
  node.bus().Unsubscribe(submaps);
  return answer;
}

int RunFinish(int argc, char** argv) {
  FinishOptions options;
  if (const auto exit_code = ParseFinishOptions(argc, argv, &options)) return *exit_code;
  const auto node = MakeClientNode("finish", Role::kOperator, options.client);
  const auto answer = AskToFinish(*node, options.timeout_s, std::cerr, options.within_s);
  if (!answer) {
    std::cerr << "skein finish: not finished yet; a session that has heard of it goes on finishing"
              << std::endl;
    return kExitError;
  }
  (answer->ok ? std::cout : std::cerr) << answer->text << std::endl;
  return answer->ok ? kExitOk : kExitError;
}

}  // namespace skein
