#include "ingest/ingest_service.h"

#include <stdexcept>

#include "core/clock.h"
#include "core/log.h"
#include "core/statistics.h"
namespace skein {
namespace {

constexpr double kTickS = 0.2;
// Two sentences and a folder's path: clients show 400 bytes of each sentence.
constexpr size_t kMaxProblemBytes = 600;

std::unique_ptr<Ledger> OpenLedger(const SessionPaths& paths) {
  auto ledger = Ledger::Open(paths.Ledger());
  if (!ledger.ok()) throw std::runtime_error(ledger.error());
  return *std::move(ledger);
}

SessionPaths PathsOf(const Node& node) { return {node.options().session_dir}; }

}  // namespace

IngestService::IngestService(Node& node, const IngestOptions& options)
    : node_(node),
      writer_(OpenLedger(PathsOf(node)), node.session_id(), NowUs),
      server_(node, writer_.durable_head(),
              [this](int64_t from_seq, int64_t to_seq, const LedgerServer::Visit& visit) {
                for (const LedgerRecord& record : writer_.Range(from_seq, to_seq)) {
                  if (!visit(FactKindFromName(record.kind), record.payload)) return;
                }
              }),
      intake_(node, writer_, PathsOf(node), options.intake, Listened()),
      submissions_(node, writer_, BlobStore(PathsOf(node).Blobs()), Listened()),
      work_(node, writer_, Listened()),
      finish_(
          node, writer_, PathsOf(node), options.finish,
          {[this] { return intake_.num_pending(); }, [this] { return intake_.num_duplicates(); },
           [this] { return work_.HasIdleMapper(); }}),
      garbage_(node, writer_, PathsOf(node), options.garbage_period_s),
      diagnoses_(writer_.state(), node.session_id(), [&node](const photo_diagnosis_t& message) {
        node.bus().Publish(kPhotoDiagnosisChannel, message);
      }) {
  LogInfo("session {}: {} facts, {} photos", writer_.session_id(), writer_.durable_head(),
          writer_.state().num_images());
  writer_.AddObserver([this](const Fact& fact) {
    server_.Broadcast(fact);
    node_.NoteCommitted(fact);
  });
  writer_.OnStaged([this] { ArrangeFlush(); });
  NoteConfiguration();
  node_.bus().RefuseWhatThrows();
  Subscribe();
  timer_ = node_.loop().AddTimer(kTickS, [this] { Tick(); });
  node_.OnHeartbeat([this](heartbeat_t* heartbeat) { FillHeartbeat(heartbeat); });
}

IngestService::~IngestService() {
  for (const auto subscription : subscriptions_) node_.bus().Unsubscribe(subscription);
  node_.loop().CancelTimer(timer_);
}

template <class T>
void IngestService::On(const Channel<T>& channel, std::function<void(const T&)> handler) {
  subscriptions_.push_back(node_.bus().Subscribe<T>(channel, std::move(handler)));
}

void IngestService::Subscribe() {
  On<image_offer_t>(kImageOfferChannel, [this](const auto& offer) { intake_.OnOffer(offer); });
  On<work_request_t>(kWorkRequestChannel,
                     [this](const auto& request) { work_.OnRequest(request); });
  On<work_failed_t>(kWorkFailedChannel, [this](const auto& failed) { work_.OnFailed(failed); });
  On<command_t>(kCommandChannel, [this](const auto& command) { finish_.OnCommand(command); });
  ForEachSubmitChannel([this](const auto& channel) { OnSubmissions(channel); });
}

template <class T>
void IngestService::OnSubmissions(const Channel<T>& channel) {
  On<T>(channel, [this](const T& fact) { submissions_.OnSubmission(Fact(fact)); });
}

// Other services submit theirs.
void IngestService::NoteConfiguration() {
  if (node_.options().configuration.empty()) return;
  const configuration_t fact = ConfigurationOf(node_.options());
  if (writer_.history().FindFact(fact.header.fact_id) == 0) writer_.Stage(fact);
}

// All that was received before the loop comes round again shares one commit.
void IngestService::ArrangeFlush() {
  node_.loop().Post(alive_.Guarded([this] { Flush(); }));
}

void IngestService::Flush() {
  writer_.Flush();
  work_.Tick();
  finish_.Step(listening_.now_s());
  TellActivity();
}

void IngestService::Tick() {
  const double now_s = node_.loop().now_s();
  listening_.NoteRound(now_s);
  if (writer_.has_staged()) writer_.Flush();  // what the disk did not take before
  intake_.Tick();
  submissions_.Tick();
  work_.Tick();
  finish_.Step(listening_.now_s());
  garbage_.Tick(now_s);
  diagnoses_.Tick(now_s);
  TellActivity();
}

void IngestService::TellActivity() {
  const SessionState& state = writer_.state();
  server_.SetActivity(intake_.num_pending() + static_cast<int>(state.num_in_flight()),
                      state.finishing());
}

std::string IngestService::ReadyState() const {
  const int64_t duplicates = intake_.num_duplicates();
  return duplicates == 0 ? "ready" : "ready, duplicates: " + std::to_string(duplicates);
}

void IngestService::FillHeartbeat(heartbeat_t* heartbeat) const {
  std::string state;
  for (const std::string& part : {writer_.problem(), finish_.Describe(), intake_.Describe()}) {
    if (!state.empty() && !part.empty()) state += "; ";
    state += part;
  }
  for (const std::string& problem : {writer_.problem(), intake_.problem(), finish_.problem()}) {
    if (heartbeat->problem.empty()) heartbeat->problem = ClampText(problem, kMaxProblemBytes);
  }
  heartbeat->state = state.empty() ? ReadyState() : ClampText(state);
  heartbeat->ledger_seq = writer_.durable_head();
  heartbeat->backlog = intake_.num_pending();
  heartbeat->num_done = writer_.state().num_images();
  const auto times = writer_.history().times().by_stage.find("ingest");
  if (times != writer_.history().times().by_stage.end()) {
    heartbeat->mean_s =
        static_cast<float>(mean(std::vector<double>(times->second.begin(), times->second.end())));
  }
}

}  // namespace skein
