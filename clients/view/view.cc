#include "clients/view/view.h"

#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>
#include <stdexcept>
#include <string>

#include "blobs/blob_store.h"
#include "clients/subcommand.h"
#include "core/file_below.h"
#include "core/json_depth.h"
#include "core/log.h"
#include "event_loop/poll_loop.h"
#include "http/web_server.h"
#include "ledger/ledger_store.h"
#include "ledger/session_folder.h"
#include "session/guidance_json.h"
#include "web/page_shape.h"
#include "web/session_api.h"
#include "web/status_message.h"

namespace skein {
namespace {

namespace fs = std::filesystem;

constexpr int kNumPoolThreads = 2;
constexpr size_t kMaxReportBytes = 256 << 20;
constexpr int kMaxReportDepth = 32;

struct ViewOptions {
  std::string session_dir, page_dir;
  WebServerOptions server;
};

std::optional<int> ParseViewOptions(int argc, char** argv, ViewOptions* options) {
  CLI::App app("Shows a session in a browser: finished, stopped or copied. Writes nothing to it.",
               "skein view");
  app.add_option("SESSION", options->session_dir, "Session folder")
      ->required()
      ->check(CLI::ExistingDirectory);
  app.add_option("--port", options->server.port, "TCP port; 0: a free one")->capture_default_str();
  app.add_option("--address", options->server.address, "IP address to listen on")
      ->capture_default_str();
  app.add_option("--page", options->page_dir, "Folder of the page; default: ../web beside skein");
  if (const auto code = ParseOptions(&app, argc, argv)) return code;
  if (const Status sound = options->server.Check(); !sound.ok()) {
    std::cerr << "skein view: " << sound.error() << "\n";
    return kExitUsage;
  }
  if (options->page_dir.empty()) {
    options->page_dir = fs::read_symlink("/proc/self/exe").parent_path().parent_path() / "web";
  }
  return std::nullopt;
}

void ReadFacts(const SessionPaths& paths, SessionView* view) {
  const Result<std::unique_ptr<Ledger>> ledger = Ledger::OpenReadOnly(paths.Ledger());
  if (!ledger.ok()) throw std::runtime_error(ledger.error());
  const Status read = (*ledger)->ForEach([&](const LedgerRecord& record) {
    const int kind = FactKindFromName(record.kind);
    const Result<Fact> fact = DecodeFact(kind, record.payload.data(), record.payload.size());
    if (!fact.ok()) {
      throw std::runtime_error("ledger, fact " + std::to_string(record.seq) + ": " + fact.error() +
                               "; `skein check` tells more");
    }
    view->Apply(*fact);
  });
  if (!read.ok()) throw std::runtime_error(read.error());
}

// As the last finish found it; nothing where there was none.
HeardGuidance ReadGuidance(const SessionPaths& paths) {
  HeardGuidance guidance;
  const Result<Bytes> report = ReadFileBelow(paths.root, paths.Report(), kMaxReportBytes);
  if (!report.ok() || !IsShallowJson(*report, kMaxReportDepth)) return guidance;
  guidance.places = PlacesOfReport(nlohmann::json::parse(*report, nullptr, false));
  return guidance;
}

// What a page is told when it comes: how the session went, and the submaps' models.
void TellState(const SessionView& view, const HeardGuidance& guidance, WebServer* server) {
  view.With([&](const SessionRecord& session) {
    server->TellLatest("status", StatusMessage(session, {}, 0, {}, guidance));
    for (const auto& [id, submap] : session.state.submaps()) {
      if (submap.ended || !submap.latest_model) continue;
      const auto version = static_cast<uint64_t>(submap.latest_model->header.utime_us);
      server->TellLatest("shape/" + std::to_string(id), ShapeMessage(id, version));
    }
    return true;
  });
}

}  // namespace

int RunView(int argc, char** argv) {
  ViewOptions options;
  if (const auto code = ParseViewOptions(argc, argv, &options)) return *code;
  InitLog("view", false);
  const Result<Session> session = OpenSession(options.session_dir);
  if (!session.ok()) throw std::runtime_error(session.error());
  SessionView view;
  ReadFacts(session->paths, &view);

  const BlobStore blobs(session->paths.Blobs());
  SessionSource source;
  source.session_id = session->session_id;
  source.session_dir = session->paths.root;
  source.page_dir = options.page_dir;
  source.may_use_model = [](int64_t) { return true; };
  source.on_look = [] {};
  source.fetch = [&blobs](const std::string& blob_id, const std::string&,
                          const SessionSource::Done& done) { done(blobs.Get(blob_id)); };
  PollLoop loop;
  loop.StopOnSignals();
  SessionApi api(view, source, kNumPoolThreads);
  options.server.session_id = session->session_id;
  Result<std::unique_ptr<WebServer>> server = WebServer::Start(
      options.server, view.events(), [&api](const HttpRequest& request, Respond respond) {
        api.Handle(request, std::move(respond));
      });
  if (!server.ok()) throw std::runtime_error(server.error());
  TellState(view, ReadGuidance(session->paths), server->get());
  std::cout << "view: http://" << options.server.address << ":" << (*server)->port()
            << "/   (Ctrl-C ends it)" << std::endl;
  loop.Run();
  return kExitOk;
}

}  // namespace skein
