#include "clients/status.h"

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <iostream>
#include <map>

#include "clients/client_node.h"
#include "clients/ingest_watch.h"
#include "clients/process_watch.h"
#include "clients/status_view.h"
#include "clients/subcommand.h"
#include "core/clock.h"
#include "node/ledger_follower.h"
#include "session/troubles.h"

namespace skein {
namespace {

constexpr double kRefreshS = 1;
// Long enough for one heartbeat of every process.
constexpr double kListenS = 1.5;
constexpr double kOnceTimeoutS = 15;
constexpr double kLookAgainS = 0.5;

struct StatusOptions {
  ClientOptions client;
  bool once = false;
  bool json = false;
};

std::optional<int> ParseStatusOptions(int argc, char** argv, StatusOptions* options) {
  CLI::App app("Shows the stages, photos, maps and failures of a session, live.", "skein status");
  AddClientOptions(app, &options->client);
  app.add_flag("--once", options->once, "Show it once and end");
  app.add_flag("--json", options->json, "One JSON object a line instead of a table");
  app.footer("Exit codes: 0 shown, 1 error or no session heard, 2 bad usage.");
  return ParseOptions(&app, argc, argv);
}

// Listens and remembers.
class StatusWatch {
 public:
  explicit StatusWatch(Node& node)
      : node_(node),
        ingest_(node),
        heard_(node),
        follower_(node, 1, [this](const Fact& fact) { session_.Apply(fact); }) {
    node.bus().Subscribe<submap_status_t>(
        kSubmapStatusChannel,
        [this](const submap_status_t& status) { submaps_[status.submap_id] = status; });
    node.bus().Subscribe<guidance_t>(
        kGuidanceChannel, [this](const guidance_t& told) { guidance_[told.submap_id] = told; });
  }

  bool caught_up() const { return follower_.caught_up(); }
  IngestWatch& ingest() { return ingest_; }

  // Until it is told which processes are missing. Where none may be, not at all.
  void AwaitSilence() const {
    while (!node_.loop().interrupted() && MayFindMore(session_.state, heard_.processes(),
                                                      node_.loop().now_s(), heard_.listened_s())) {
      node_.loop().RunUntil([] { return false; }, kLookAgainS);
    }
  }

  void Print(bool as_json) const {
    const nlohmann::json status =
        MakeStatus({node_.session_id(), session_, heard_.processes(), submaps_,
                    node_.loop().now_s(), heard_.listened_s(), guidance_});
    if (as_json) {
      std::cout << status.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace)
                << std::endl;
      return;
    }
    if (isatty(STDOUT_FILENO) != 0) std::cout << "\x1b[H\x1b[2J";
    std::cout << FormatStatus(status) << std::endl;
    if (ingest_.is_silent()) std::cout << NoSignOfIngest(node_) << std::endl;
  }

 private:
  Node& node_;
  IngestWatch ingest_;
  ProcessWatch heard_;
  SessionRecord session_;
  std::map<int64_t, submap_status_t> submaps_;
  std::map<int64_t, guidance_t> guidance_;
  LedgerFollower follower_;
};

}  // namespace

int RunStatus(int argc, char** argv) {
  StatusOptions options;
  if (const auto exit_code = ParseStatusOptions(argc, argv, &options)) return *exit_code;
  const auto node = MakeClientNode("status", Role::kViewer, options.client);
  StatusWatch watch(*node);
  const double start_s = MonotonicS();
  const auto tell_silence = [&] { watch.ingest().TellChange("skein status", std::cerr); };
  const PollLoop::TimerId timer = options.once ? 0 : node->loop().AddTimer(kRefreshS, tell_silence);
  const bool heard = node->loop().RunUntil(
      [&] { return watch.caught_up() && MonotonicS() - start_s > kListenS; }, kOnceTimeoutS);
  if (!heard && options.once) {
    std::cerr << "skein status: "
              << (watch.ingest().is_silent() ? NoSignOfIngest(*node)
                                             : "the session's photos are not read yet; try again")
              << std::endl;
    return kExitError;
  }
  if (options.once) watch.AwaitSilence();
  watch.Print(options.json);
  if (options.once) return kExitOk;
  if (!options.json) node->loop().CancelTimer(timer);  // the table tells it
  node->loop().AddTimer(kRefreshS, [&] { watch.Print(options.json); });
  node->loop().Run();
  return kExitOk;
}

}  // namespace skein
