#include "clients/scale/scale.h"

#include <fcntl.h>
#include <sys/file.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdlib>
#include <iostream>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "clients/client_node.h"
#include "clients/ingest_watch.h"
#include "clients/invite.h"
#include "clients/scale/engine.h"
#include "clients/scale/engine_thread.h"
#include "clients/scale/worker_demand.h"
#include "clients/scale/worker_pool.h"
#include "clients/store/session_admit.h"
#include "clients/subcommand.h"
#include "core/clock.h"
#include "core/counted.h"
#include "core/file_below.h"
#include "node/ledger_follower.h"

namespace skein {
namespace {

constexpr double kLookS = 2;
// A worker is forgotten once it is silent for so long.
constexpr double kForgetS = 600;
constexpr int kMostWorkers = 1000;

struct ScaleOptions {
  ClientOptions client;
  std::string engine = "local";
  int min = 0;
  int max = 1;
  double target_s = 60;
  int cores = 1;
  std::string expires = "12h";
  double idle_after_s = WorkerPool::kIdleAfterS;
  std::vector<std::string> job_options;
  std::vector<std::string> launch_options;
};

std::optional<int> ParseScaleOptions(int argc, char** argv, ScaleOptions* options) {
  CLI::App app(
      "Workers (features, matching) come and go with a session's backlog, until Ctrl-C, which "
      "ends\n"
      "them. Wanted are backlog x seconds an item / target of them. If this command dies, the\n"
      "workers go on, and the next one takes them over. `skein status` shows what it does.\n"
      "What stands behind -- is given to each worker's `skein launch`, as: -- --max-size 2400",
      "skein scale");
  AddClientOptions(app, &options->client);
  app.get_option("--session")->required();
  app.add_option("--engine", options->engine,
                 "Where they run: local (this host) or slurm (an array of jobs); default local")
      ->check(CLI::IsMember(EngineNames()));
  app.add_option("--min", options->min, "Workers that are always there (default 0)")
      ->check(CLI::Range(0, kMostWorkers));
  app.add_option("--max", options->max, "Workers at most")
      ->required()
      ->check(CLI::Range(1, kMostWorkers));
  app.add_option("--target", options->target_s,
                 "Seconds within which a backlog is to be worked off (default 60)")
      ->check(CLI::Range(1.0, 1e6));
  app.add_option("--cores", options->cores, "Cores of a worker (default 1)")
      ->check(CLI::Range(1, 1024));
  app.add_option("--idle-after", options->idle_after_s,
                 "Seconds after which spare workers leave (default 60)")
      ->check(CLI::Range(1.0, 1e6));
  app.add_option(
      "--expires", options->expires,
      "A worker's invitation ends after a number of s, m, h or d (default 12h); a worker "
      "or a waiting job is replaced then");
  app.add_option("--job-option", options->job_options,
                 "Given to the engine, as --job-option --partition=long (of sbatch); repeat it")
      ->take_all()
      ->allow_extra_args(false);
  app.add_option("launch_options", options->launch_options, "Options of each worker");
  if (const auto code = ParseOptions(&app, argc, argv)) return code;
  if (options->min <= options->max) return std::nullopt;
  std::cerr << "skein scale: --min is above --max" << std::endl;
  return kExitUsage;
}

// As launch.sh shares a host's cores.
std::vector<std::string> LaunchOptions(const ScaleOptions& options) {
  const auto part = [&](int divisor) {
    return std::to_string(std::max(1, options.cores / divisor));
  };
  std::vector<std::string> words = {"--mappers",  "0",     "--features", part(4),
                                    "--matching", part(2), "--threads",  part(2)};
  if (!options.client.node.auth.empty()) {
    words.insert(words.end(), {"--auth", options.client.node.auth});
  }
  words.insert(words.end(), options.launch_options.begin(), options.launch_options.end());
  return words;
}

void Tell(const std::string& line) { std::cout << "skein scale: " << line << std::endl; }

// The engine's scripts write to run/scale by the shell, which follows links. Throws
// std::runtime_error.
Session AdmittedSession(const std::string& folder) {
  Result<Session> session = OpenSession(folder);
  if (!session.ok()) throw std::runtime_error(session.error());
  const Status admitted = AdmitSession(session->paths, false).status();
  if (!admitted.ok()) throw std::runtime_error(admitted.error());
  return *std::move(session);
}

// Two of them would take each other's workers for their own. Held until this process ends.
FileDescriptor LockOf(const Session& session, const std::filesystem::path& folder) {
  const Status made = CreateFoldersBelow(session.paths.root, folder, 0700);
  if (!made.ok()) throw std::runtime_error(made.error());
  Result<FileDescriptor> file =
      OpenFileBelow(session.paths.root, folder / "lock", O_RDWR | O_CREAT);
  if (!file.ok()) throw std::runtime_error(file.error());
  if (::flock(file->get(), LOCK_EX | LOCK_NB) == 0) return *std::move(file);
  throw std::runtime_error("another skein scale runs on " + session.paths.root.string());
}

// Looks at backlog and jobs every kLookS and does what the pool decides.
class Scaler {
 public:
  Scaler(Node& node, Session session, const LcmUrl& url, const ScaleOptions& options)
      : node_(node),
        session_(std::move(session)),
        url_(url),
        options_(options),
        pool_(options.idle_after_s),
        ingest_(node),
        engine_(node.loop(), OpenEngine(options.engine)),
        follower_(node, 1, [this](const Fact& fact) { OnFact(fact); }) {
    node.bus().Subscribe<heartbeat_t>(
        kHeartbeatChannel, [this](const heartbeat_t& heartbeat) { OnHeartbeat(heartbeat); });
    node.loop().AddTimer(kLookS, [this] { Look(); });
    node.OnHeartbeat([this](heartbeat_t* heartbeat) {
      heartbeat->state = Describe();
      heartbeat->problem = problem_.empty() ? pool_.uncancelled() : problem_;
    });
  }

  // Throws std::runtime_error where this host cannot run the engine.
  void CheckEngine() {
    const auto jobs = engine_.ListAndWait();
    if (jobs.code() == StatusCode::kFailedPrecondition) throw std::runtime_error(jobs.error());
    if (jobs.ok() && !jobs->empty()) Tell("takes over " + Counted(jobs->size(), "worker"));
  }

  // All workers leave. After the loop has ended.
  void EndWorkers() {
    const Result<size_t> ended = engine_.CancelAllAndWait();
    Tell(ended.ok() ? "ends and tells " + Counted(*ended, "worker") + " to leave"
                    : "ends; workers may be left: " + ended.error());
  }

 private:
  void OnFact(const Fact& fact) {
    record_.Apply(fact);
    tally_.Apply(fact, record_.state);
  }

  void OnHeartbeat(const heartbeat_t& heartbeat) {
    const std::string name = heartbeat.instance.substr(0, heartbeat.instance.find('.'));
    if (ExpiryOfWorker(name) == 0) return;
    processes_[name][heartbeat.instance] = {MonotonicS(), heartbeat.backlog};
  }

  HeardWorkers Heard() {
    HeardWorkers heard;
    for (auto it = processes_.begin(); it != processes_.end();) {
      HeardWorker& worker = heard[it->first];
      for (const auto& [instance, process] : it->second) {
        worker.heard_s = std::max(worker.heard_s, process.heard_s);
        worker.backlog += process.backlog;
      }
      const bool is_gone = MonotonicS() - worker.heard_s > kForgetS;
      it = is_gone ? processes_.erase(it) : std::next(it);
    }
    return heard;
  }

  // A session that is not heard needs nobody.
  WorkerDemand Demand() const {
    return ingest_.is_silent() ? WorkerDemand{} : DemandOf(tally_, record_.history.times());
  }
  int Wanted() const {
    return NumWanted(Demand().work_s / options_.cores, options_.target_s, options_.min,
                     options_.max);
  }

  void Look() {
    ingest_.TellChange("skein scale", std::cerr);
    if (engine_.is_busy() || !follower_.caught_up()) return;
    engine_.List([this](const EngineThread::Jobs& jobs) { OnJobs(jobs); });
  }

  void OnJobs(const EngineThread::Jobs& jobs) {
    if (!jobs.ok()) return OnDone(jobs.status());
    const WorkerPool::Plan plan =
        pool_.Decide(*jobs, Heard(), Wanted(), {MonotonicS(), NowUs() / 1'000'000});
    for (const std::string& line : plan.told) Tell(line);
    if (!plan.leaving.empty()) return Cancel(plan.leaving);
    if (plan.num_new > 0) return Submit(plan.num_new);
    OnDone(Status::Ok());
  }

  void Cancel(const std::vector<std::string>& names) {
    engine_.Cancel(names, [this, names](const Status& status) { OnCancelled(names, status); });
  }

  void OnCancelled(const std::vector<std::string>& names, const Status& status) {
    const std::string told = pool_.uncancelled();
    pool_.OnCancelled(names, status, MonotonicS());
    if (!status.ok() && pool_.uncancelled() != told) {
      Tell(Counted(names.size(), "worker") +
           " not cancelled, another try comes later: " + status.error());
    }
    OnDone(Status::Ok());
  }

  void Submit(int count) {
    const int64_t expires_s = ExpiryOf(options_.expires);
    std::vector<std::string> names, links;
    for (int i = 1; i <= count; ++i) {
      names.push_back(WorkerName(expires_s, i));
      links.push_back(
          ToLink(MakeInvitation(session_, url_, Role::kWorker, names.back(), expires_s)));
    }
    const std::string batch = names[0].substr(0, names[0].find('-'));
    engine_.Submit(batch, links, options_.job_options, LaunchOptions(options_),
                   [this, names](const Status& status) { OnSubmitted(names, status); });
  }

  void OnSubmitted(const std::vector<std::string>& names, const Status& status) {
    pool_.OnSubmitted(names, status, MonotonicS());
    if (status.ok()) Tell("submits " + Counted(names.size(), "worker") + " for " + Photos());
    OnDone(Status::Ok());
  }

  // `status` is of listing; the pool knows of submissions and cancellations.
  void OnDone(const Status& status) {
    const std::string& problem = status.ok() ? pool_.problem() : status.error();
    if (problem != problem_ && !problem.empty()) {
      Tell(problem + "; the session goes on without more workers");
    }
    problem_ = problem;
  }

  std::string Photos() const { return Counted(Demand().num_photos, "photo") + " in work"; }
  std::string Describe() const {
    return "running: " + Counted(pool_.num_running(), "worker") + ", waiting in the queue of " +
           options_.engine + ": " + std::to_string(pool_.num_waiting()) + "; " +
           std::to_string(Wanted()) + " wanted for " + Photos();
  }

  Node& node_;
  const Session session_;
  const LcmUrl url_;
  const ScaleOptions options_;
  WorkerPool pool_;
  SessionRecord record_;
  SessionTally tally_;
  std::map<std::string, std::map<std::string, HeardWorker>> processes_;  // by worker, by instance
  std::string problem_;                                                  // told last
  IngestWatch ingest_;
  EngineThread engine_;
  LedgerFollower follower_;
};

LcmUrl UrlOf(const Node& node, const ScaleOptions& options) {
  LcmUrl url = ParseLcmUrl(node.options().lcm_url);
  if (url.leaves_host() || options.engine == "local") return url;
  throw std::runtime_error(url.ToString() +
                           " is heard on this host alone; for other hosts launch the session with "
                           "--lcm-url tcpqs://HOST:7700");
}

}  // namespace

int RunScale(int argc, char** argv) {
  ScaleOptions options;
  if (const auto code = ParseScaleOptions(argc, argv, &options)) return *code;
  try {
    ExpiryOf(options.expires);
  } catch (const std::invalid_argument& error) {
    std::cerr << "skein scale: " << error.what() << std::endl;
    return kExitUsage;
  }
  const Session session = AdmittedSession(options.client.session_dir);
  const auto node = MakeClientNode("scale", Role::kViewer, options.client);
  const std::filesystem::path folder =
      std::filesystem::absolute(session.paths.root) / "run" / "scale";
  const FileDescriptor lock = LockOf(session, folder);
  ::setenv("SKEIN_SESSION_ID", session.session_id.c_str(), 1);
  ::setenv("SKEIN_SCALE_FOLDER", folder.c_str(), 1);
  ::setenv("SKEIN_WORKER_CORES", std::to_string(options.cores).c_str(), 1);
  Scaler scaler(*node, session, UrlOf(*node, options), options);
  scaler.CheckEngine();
  node->loop().Run();
  scaler.EndWorkers();
  return kExitOk;
}

}  // namespace skein
