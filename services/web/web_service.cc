#include "web/web_service.h"

#include <stdexcept>
#include <utility>

#include "core/attempt.h"
#include "core/counted.h"
#include "core/log.h"
#include "http/static_files.h"
#include "ledger/session_folder.h"
#include "web/page_shape.h"

namespace skein {
namespace {

namespace fs = std::filesystem;

constexpr int kNumPoolThreads = 2;
// Two write at a time. Of those that the disk holds up an agent has UploadStore::kMaxReceiving and
// one that deletes, and the server no more connections than these threads.
constexpr int kNumUploadThreads = 2, kMoreUploadThreads = 254;
constexpr double kStatusS = 1;
constexpr double kForgetProcessS = 60;
// A blob of which nothing has come for so long is given up.
constexpr double kFetchPatienceS = 20;

fs::path PageDir(const std::string& given) {
  return given.empty() ? fs::read_symlink("/proc/self/exe").parent_path().parent_path() / "web"
                       : fs::path(given);
}

std::string DenseKey(int64_t submap_id) { return "dense/" + std::to_string(submap_id); }

// A fetch that ends, with an error where its owner is silent.
struct Fetching {
  BlobClient::FetchId id = 0;
  int64_t received_bytes = -1;
  bool done = false;
};

// On the loop's thread. An exception in what is made of the blob ends the request alone, which is
// answered 500.
void Answer(const SessionSource::Done& done, Result<Bytes> bytes) {
  const Status answered = Attempt([&] { done(std::move(bytes)); });
  if (!answered.ok()) LogError("a request failed: {}", answered.error());
}

void WatchFetch(Node& node, const std::shared_ptr<Fetching>& fetching,
                const SessionSource::Done& done) {
  node.loop().AddOneShot(kFetchPatienceS, [&node, fetching, done] {
    if (fetching->done) return;
    const int64_t received = node.blobs().ReceivedBytes(fetching->id);
    if (received > std::exchange(fetching->received_bytes, received)) {
      return WatchFetch(node, fetching, done);
    }
    fetching->done = true;
    node.blobs().Cancel(fetching->id);
    Answer(done, Unavailable("the data's owner does not answer: try again"));
  });
}

}  // namespace

WebService::WebService(Node& node, const WebOptions& options)
    : node_(node), options_(options), listens_since_s_(node.loop().now_s()) {
  if (CheckVisitors(node.options()).ok()) {
    upload_jobs_ = std::make_unique<JobPool>(kNumUploadThreads, kMoreUploadThreads);
    const auto run_job = [&jobs = *upload_jobs_](std::function<void()> job) {
      jobs.Run(std::move(job));
    };
    visitors_ = OpenVisitors(node, options, run_job);
    if (options.is_public()) {
      uploads_ = std::make_unique<UploadStore>(SessionPaths{node.options().session_dir}.Uploads(),
                                               options.uploads, run_job);
      uploads_api_ = std::make_unique<UploadsApi>(view_, *uploads_, *upload_jobs_, News());
    }
    finish_asker_ = std::make_unique<FinishAsker>(node, [this](int64_t command_id) {
      return view_.With([&](const SessionRecord& session) {
        return session.history.finish_of_command().count(command_id) > 0;
      });
    });
  }
  api_ = std::make_unique<SessionApi>(view_, Source(), kNumPoolThreads);
  shapes_ = std::make_unique<ShapeFollower>(node, api_->shapes(), FollowShapes());
  dense_ = FollowDense();
  StartServer();
  subscriptions_ = {
      node.bus().Subscribe(kHeartbeatChannel, [this](const heartbeat_t& m) { OnHeartbeat(m); }),
      node.bus().Subscribe(kGuidanceChannel, [this](const guidance_t& m) { OnGuidance(m); }),
      node.bus().Subscribe(kAdviceChannel, [this](const advice_t& m) { OnAdvice(m); })};
  follower_ = std::make_unique<LedgerFollower>(node, 1, [this](const Fact& fact) { OnFact(fact); });
  if (uploads_) {
    desk_ = std::make_unique<UploadDesk>(node, *uploads_, [this](const std::string& blob_id) {
      return view_.With([&](const SessionRecord& session) {
        return session.history.FindImageByBlob(blob_id) != 0;
      });
    });
  }
  timer_ = node_.loop().AddTimer(kStatusS, [this] {
    if (visitors_) visitors_->Look();
    if (follower_->caught_up()) has_read_ledger_ = true;
    TellStatus();
  });
  node_.OnHeartbeat([this](heartbeat_t* heartbeat) {
    heartbeat->ledger_seq = follower_->processed_seq();
    heartbeat->state =
        Counted(server_->num_viewers(), "viewer") + ", port " + std::to_string(server_->port());
    if (desk_ && desk_->num_offered() > 0) {
      heartbeat->state += ", " + std::to_string(desk_->num_offered()) + " uploaded photos offered";
    }
  });
}

WebService::~WebService() {
  for (const auto id : subscriptions_) node_.bus().Unsubscribe(id);
  node_.loop().CancelTimer(timer_);
  desk_.reset();
  dense_.reset();
  server_.reset();       // no request comes any more
  upload_jobs_.reset();  // nor is one under way, before what they ask goes
  api_.reset();
}

ShapeFollowerOptions WebService::FollowShapes() {
  ShapeFollowerOptions options;
  options.read_session = [this](const std::function<void(const SessionState&)>& read) {
    view_.With([&](const SessionRecord& session) { read(session.state); });
  };
  options.is_wanted = [this] { return server_->num_viewers() > 0; };
  options.on_shape = [this](int64_t submap_id, uint64_t version) {
    server_->TellLatest("shape/" + std::to_string(submap_id), ShapeMessage(submap_id, version));
  };
  options.on_model = options.on_shape;
  return options;
}

std::unique_ptr<DenseFollower> WebService::FollowDense() {
  return std::make_unique<DenseFollower>(
      node_, api_->dense(),
      [this](int64_t submap_id) {
        return view_.With(
            [&](const SessionRecord& session) { return session.state.IsLive(submap_id); });
      },
      [this](int64_t submap_id, const DensePoints& points) {
        server_->TellLatest(DenseKey(submap_id), DenseMessage(submap_id, points));
      });
}

void WebService::StartServer() {
  WebServerOptions server = options_.server;
  server.session_id = node_.session_id();
  if (visitors_) visitors_->LetIn(&server);
  Uploads uploads;
  if (uploads_api_) {
    uploads.make_sink = [this](const HttpRequest& request) {
      return uploads_api_->MakeSink(request);
    };
  }
  uploads.agent_of_photo = [this](int64_t image_id) { return api_->AgentOfPhoto(image_id); };
  Result<std::unique_ptr<WebServer>> started = WebServer::Start(
      server, view_.events(),
      [this](const HttpRequest& request, Respond respond) {
        api_->Handle(request, std::move(respond));
      },
      uploads);
  if (!started.ok()) throw std::runtime_error(started.error());
  server_ = std::move(*started);
  const Status page = StaticFiles(PageDir(options_.page_dir)).Check();
  if (!page.ok()) LogWarn("browsers are shown no map: {}", page.error());
  LogInfo("view: http://{}:{}/", options_.server.address, server_->port());
  if (options_.is_public()) {
    LogInfo("visitors with an invitation: {} {}; fingerprint of the certificate: {}",
            visitors_->addresses().secure, visitors_->addresses().plain,
            visitors_->addresses().fingerprint);
  }
}

UploadNews WebService::News() {
  UploadNews news;
  news.has_read_ledger = [this] { return has_read_ledger_.load(); };
  news.advice = [this](const std::string& agent) { return AdviceFor(agent); };
  news.troubles = [this] { return Troubles(); };
  return news;
}

SessionSource WebService::Source() {
  SessionSource source;
  source.session_id = node_.session_id();
  source.live = true;
  source.session_dir = node_.options().session_dir;
  source.page_dir = PageDir(options_.page_dir);
  source.fetch = [this](const std::string& blob_id, const std::string& owner,
                        SessionSource::Done done) { Fetch(blob_id, owner, std::move(done)); };
  source.may_use_model = [this](int64_t submap_id) { return shapes_->MayUseModel(submap_id); };
  source.troubles = [this] { return Troubles(); };
  source.processes = [this] { return ProcessesHeard(); };
  source.has_read_ledger = [this] { return has_read_ledger_.load(); };
  source.on_look = [this] { shapes_->NoteLook(); };
  if (finish_asker_) {
    source.finish = [this](double within_s, std::function<void(Status)> done) {
      node_.loop().Post(
          [this, within_s, done = std::move(done)] { finish_asker_->Ask(within_s, done); });
    };
  }
  if (uploads_) AddVisitors(&source);
  return source;
}

// Of other hosts.
void WebService::AddVisitors(SessionSource* source) {
  source->addresses = visitors_->addresses();
  source->uploads = [this](const std::string& name, const HttpRequest& request, Respond respond) {
    uploads_api_->Handle(name, request, std::move(respond));
  };
  source->invite = [this](Role role, const std::string& name) {
    return visitors_->Invite(role, name, 0);
  };
}

void WebService::Fetch(const std::string& blob_id, const std::string& owner,
                       SessionSource::Done done) {
  node_.loop().Post([&node = node_, blob_id, owner, done = std::move(done)] {
    const auto fetching = std::make_shared<Fetching>();
    fetching->id = node.blobs().Fetch(blob_id, owner, [fetching, done](Result<Bytes> bytes) {
      if (!std::exchange(fetching->done, true)) Answer(done, std::move(bytes));
    });
    WatchFetch(node, fetching, done);
  });
}

void WebService::OnFact(const Fact& fact) {
  view_.Apply(fact);
  server_->NoteEvents();
  if (const auto* end = std::get_if<submap_end_t>(&fact)) {
    api_->shapes().Drop(end->submap_id);
    dense_->Drop(end->submap_id);
    if (api_->dense().Drop(end->submap_id)) {
      server_->TellLatest(DenseKey(end->submap_id), DenseGoneMessage(end->submap_id));
    }
    const std::lock_guard<std::mutex> lock(told_mutex_);
    guidance_.places.erase(end->submap_id);
    server_->TellLatest("shape/" + std::to_string(end->submap_id), GoneMessage(end->submap_id));
  }
}

void WebService::OnHeartbeat(const heartbeat_t& heartbeat) {
  if (heartbeat.state == kEndedState) {
    processes_.erase(heartbeat.instance);
  } else {
    processes_[heartbeat.instance] = {heartbeat, node_.loop().now_s(),
                                      heartbeat.utime_us - NowUs()};
  }
}

// Of submaps and agents that the ledger does not know nothing is kept.
void WebService::OnGuidance(const guidance_t& guidance) {
  const bool is_live = view_.With(
      [&](const SessionRecord& session) { return session.state.IsLive(guidance.submap_id); });
  if (!is_live) return;
  const std::lock_guard<std::mutex> lock(told_mutex_);
  guidance_.places[guidance.submap_id] = guidance;
}

void WebService::OnAdvice(const advice_t& advice) {
  const bool is_known = view_.With([&](const SessionRecord& session) {
    const PhotoState* photo = session.state.FindPhoto(advice.last_image_id);
    return photo != nullptr && photo->image.agent == advice.agent;
  });
  if (!is_known) return;
  const std::lock_guard<std::mutex> lock(told_mutex_);
  guidance_.advice[advice.agent] = advice;
}

// On threads of the API.
std::optional<advice_t> WebService::AdviceFor(const std::string& agent) const {
  std::optional<advice_t> advice;
  {
    const std::lock_guard<std::mutex> lock(told_mutex_);
    const auto found = guidance_.advice.find(agent);
    if (found != guidance_.advice.end()) advice = found->second;
  }
  const bool is_live = advice && view_.With([&](const SessionRecord& session) {
    return session.state.IsLive(advice->submap_id);
  });
  return is_live ? advice : std::nullopt;
}

// On threads of the API.
std::vector<Trouble> WebService::Troubles() const {
  const std::lock_guard<std::mutex> lock(told_mutex_);
  return troubles_;
}

// On threads of the API.
HeardProcesses WebService::ProcessesHeard() const {
  const std::lock_guard<std::mutex> lock(told_mutex_);
  return heard_processes_;
}

void WebService::TellStatus() {
  const double now_s = node_.loop().now_s();
  for (auto process = processes_.begin(); process != processes_.end();) {
    const bool gone = now_s - process->second.heard_s > kForgetProcessS;
    process = gone ? processes_.erase(process) : std::next(process);
  }
  const std::vector<Trouble> troubles = view_.With([&](const SessionRecord& session) {
    return FindTroubles(session.state, processes_, now_s, now_s - listens_since_s_);
  });
  HeardProcesses heard;
  for (const auto& [instance, process] : processes_) {
    if (now_s - process.heard_s <= kSilentProcessS) heard.emplace(instance, process);
  }
  {
    const std::lock_guard<std::mutex> lock(told_mutex_);
    troubles_ = troubles;
    heard_processes_ = std::move(heard);
  }
  if (server_->num_viewers() == 0 && !told_status_.empty()) return;
  const HeardGuidance guidance = [this] {
    const std::lock_guard<std::mutex> lock(told_mutex_);
    return guidance_;
  }();
  std::string status = view_.With([&](const SessionRecord& session) {
    return StatusMessage(session, processes_, now_s, troubles, guidance);
  });
  if (status == told_status_) return;
  told_status_ = status;
  server_->TellLatest("status", std::move(status));
}

}  // namespace skein
