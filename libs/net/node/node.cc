#include "node/node.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <utility>

#include "auth/relay_certificate.h"
#include "auth/revocations.h"
#include "auth/session_keys.h"
#include "core/clock.h"
#include "core/log.h"
#include "core/process.h"
#include "core/version.h"
#include "ledger/fact_ids.h"
#include "ledger/session_folder.h"

namespace skein {
namespace {

constexpr double kKeepCountersS = 5.0;

constexpr double kTellThrownS = 60;

// "" once the loop has noted no exception for kTellThrownS.
std::string ProblemOf(const PollLoop& loop) {
  const PollLoop::Thrown& thrown = loop.thrown();
  if (thrown.count == 0 || loop.now_s() - thrown.last_s > kTellThrownS) return "";
  return ClampText("it goes on after an exception of " + thrown.last);
}

// A signal came before there was a session.
struct Interrupted : std::exception {
  const char* what() const noexcept override { return "interrupted"; }
};

bool IsInstanceName(const std::string& name) {
  return !name.empty() && name.size() <= 64 && std::all_of(name.begin(), name.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' ||
           c == '_' || c == '.';
  });
}

// Whether a process that signs as `needed` may do so with an invitation of `role`.
bool Suffices(Role role, Role needed) {
  if (needed == Role::kViewer || role == needed) return true;
  return needed == Role::kAgent && role == Role::kOperator;
}

// The instance as the invitation's holder may call itself.
std::string InvitedInstance(const Certificate& certificate, const std::string& instance) {
  const Speaker speaker{certificate.role, certificate.name};
  if (MayBe(speaker, instance)) return instance;
  if (certificate.role == Role::kAgent) return "agent." + certificate.name;
  return certificate.name + "." + instance;
}

void Accept(const std::string& link, NodeOptions* options) {
  if (!options->session_dir.empty() || !options->session_id.empty()) {
    throw std::invalid_argument(
        "--invite says which session: leave --session and --session-id out");
  }
  Result<Invitation> invitation = ReadInvitation(link);
  if (!invitation.ok()) throw std::invalid_argument("--invite: " + invitation.error());
  const Certificate& certificate = invitation->credential.certificate;
  if (!Suffices(certificate.role, options->signer.role)) {
    throw std::invalid_argument(std::string("--invite: the invitation is for the role ") +
                                RoleName(certificate.role) + ", this takes one for " +
                                RoleName(options->signer.role));
  }
  if (IsExpired(certificate, NowUs() / 1'000'000)) {
    throw std::invalid_argument("--invite: the invitation has expired; ask for another");
  }
  options->session_id = invitation->trust.session_id;
  if (options->lcm_url.empty()) options->lcm_url = invitation->url.ToString();
  options->instance = InvitedInstance(certificate, options->instance);
  options->signer.invitation = *std::move(invitation);
}

std::string KeysDirOf(const NodeOptions& options) {
  return options.session_dir.empty() ? options.signer.keys_dir
                                     : SessionPaths{options.session_dir}.Keys().string();
}

// A tcpqs URL with the pin that the invitation or the session's folder tells.
std::string WithPin(const NodeOptions& options) {
  if (options.lcm_url.rfind("tcpqs:", 0) != 0) return options.lcm_url;
  LcmUrl url = ParseLcmUrl(options.lcm_url);
  const std::string keys_dir = KeysDirOf(options);
  if (!url.pin.empty()) return options.lcm_url;
  if (options.signer.invitation) {
    url.pin = options.signer.invitation->url.pin;
  } else if (!keys_dir.empty()) {
    const Result<std::string> pin = ReadRelayPin(keys_dir);
    if (!pin.ok()) throw std::runtime_error(pin.error());
    url.pin = *pin;
  }
  return url.ToString();
}

NodeOptions Completed(NodeOptions options) {
  if (options.instance.empty()) options.instance = options.service;
  if (!options.invite.empty()) Accept(options.invite, &options);
  if (!IsInstanceName(options.instance)) {
    throw std::invalid_argument("--instance \"" + options.instance +
                                "\": give 1 to 64 letters, digits, '-', '_' or '.'");
  }
  if (options.session_dir.empty() == options.session_id.empty()) {
    throw std::invalid_argument(
        "give --session DIR on the host of the session folder, or --invite LINK elsewhere");
  }
  if (options.signer.certified_name.empty()) {
    options.signer.certified_name = options.instance.substr(0, options.instance.find('.'));
  }
  const char* url = std::getenv("LCM_DEFAULT_URL");
  if (options.lcm_url.empty() && url != nullptr) options.lcm_url = url;
  options.lcm_url = WithPin(options);
  return options;
}

// Of the invitation, or of the session's folder. None for who may do without.
std::optional<SessionAccess> FindAccess(const NodeOptions& options, const std::string& keys_dir,
                                        const std::string& session_id, bool is_required) {
  const bool is_worker =
      options.signer.role == Role::kWorker || options.signer.role == Role::kIngest;
  if (options.signer.invitation) {
    return SessionAccess{
        options.signer.invitation->trust, options.signer.invitation->credential, {}};
  }
  if (keys_dir.empty()) {
    if (!is_required && !is_worker) return std::nullopt;
    throw std::invalid_argument(
        "nobody hears it without a credential; give --invite LINK (`skein invite` on the session's "
        "host prints one), or --auth off to every process of the session");
  }
  Result<SessionAccess> access =
      OpenSessionKeys(keys_dir, session_id, options.signer.role, options.signer.certified_name);
  if (access.ok()) return *std::move(access);
  if (is_required || is_worker) throw std::runtime_error(access.error());
  LogWarn("goes on without a signature: {}", access.error());
  return std::nullopt;
}

}  // namespace

Auth AuthOf(const std::string& text, const LcmUrl& url) {
  if (text == "off") return Auth::kOff;
  if (text == "warn") return Auth::kWarn;
  if (text == "require") return Auth::kRequire;
  if (!text.empty()) {
    throw std::invalid_argument("--auth is \"" + text + "\": give off, warn or require");
  }
  if (url.provider == "memq") return Auth::kOff;
  return url.leaves_host() ? Auth::kRequire : Auth::kWarn;
}

Node::Node(const NodeOptions& options)
    : options_(Completed(options)),
      steps_(StepRecord::FileOfSupervisor()),
      own_loop_(std::make_unique<PollLoop>()),
      sign_of_life_(std::make_unique<SignOfLife>(*own_loop_)),
      own_bus_(std::make_unique<Bus>(options_.lcm_url, *own_loop_)),
      loop_(*own_loop_),
      bus_(*own_bus_) {
  loop_.StopOnSignals();
  Start();
}

Node::Node(const NodeOptions& options, PollLoop& loop, Bus& bus)
    : options_(Completed(options)), steps_(""), loop_(loop), bus_(bus) {
  Start();
}

// The object that fills heartbeats may be destroyed by now.
Node::~Node() {
  loop_.CancelTimer(heartbeat_timer_);
  if (counters_timer_ != 0) KeepCounters();
  loop_.CancelTimer(counters_timer_);
  fill_heartbeat_ = [](heartbeat_t* beat) { beat->state = kEndedState; };
  SendHeartbeat();
}

void Node::Start() {
  session_id_ = FindSession();
  bus_.SetSession(session_id_);
  if (own_bus_) SealBus();
  BlobClientOptions blob_options;
  blob_options.session_id = session_id_;
  blob_options.instance = options_.instance;
  blob_options.cache_bytes = options_.cache_bytes;
  if (shares_folder()) blob_options.store_dir = SessionPaths{options_.session_dir}.Blobs();
  blobs_ = std::make_unique<BlobClient>(loop_, bus_, std::move(blob_options));
  submitter_ = std::make_unique<Submitter>(loop_, bus_, *blobs_, session_id_, options_.instance);
  heartbeat_timer_ = loop_.AddTimer(kHeartbeatS, [this] { SendHeartbeat(); });
}

void Node::SealBus() {
  const Auth auth = AuthOf(options_.auth, bus_.url());
  if (auth == Auth::kOff) return;
  const auto access =
      FindAccess(options_, KeysDirOf(options_), session_id_, auth == Auth::kRequire);
  if (!access) return;
  auto seal = std::make_unique<MessageSeal>(access->trust, access->credential, access->used, NowUs);
  if (!KeysDirOf(options_).empty()) seal->SetRevoked(Revocations(KeysDirOf(options_)));
  bus_.SetSeal(std::move(seal), auth == Auth::kWarn);
  if (options_.signer.role != Role::kIngest) return;
  // Counters rise over all channels: a heartbeat's is above those of what its signer said before.
  bus_.Subscribe(kHeartbeatChannel, [](const heartbeat_t&) {});
  counters_timer_ = loop_.AddTimer(kKeepCountersS, [this] { KeepCounters(); });
}

void Node::KeepCounters() {
  const Status status = SaveCounters(KeysDirOf(options_), bus_.seal()->Counters());
  if (!status.ok()) LogWarn("a message may be taken twice after a restart: {}", status.error());
}

std::string Node::FindSession() {
  if (options_.session_id == "auto") return HearSession();
  if (!shares_folder()) return options_.session_id;
  const Result<Session> session = OpenOrCreateSession(options_.session_dir);
  if (!session) throw std::runtime_error(session.error());
  return session->session_id;
}

std::string Node::HearSession() {
  std::string heard;
  const auto subscription = bus_.Subscribe<ledger_head_t>(
      kLedgerHeadChannel, [&heard](const ledger_head_t& head) { heard = head.session_id; });
  loop_.RunUntil([&heard] { return !heard.empty(); }, options_.auto_session_timeout_s);
  bus_.Unsubscribe(subscription);
  if (loop_.interrupted()) throw Interrupted();
  if (heard.empty()) {
    throw std::runtime_error(
        "no session heard at " + bus_.url().ToString() +
        "; is `skein launch` running, and with this URL? Give --session DIR on "
        "its host, --invite LINK elsewhere");
  }
  return heard;
}

void Node::Run() {
  std::printf("ready %s\n", options_.instance.c_str());
  std::fflush(stdout);
  loop_.Run();
}

void Node::SendHeartbeat() {
  heartbeat_t beat{};
  beat.session_id = session_id_;
  beat.service = options_.service;
  beat.instance = options_.instance;
  beat.host = HostName();
  beat.pid = static_cast<int32_t>(::getpid());
  beat.version = Version();
  beat.utime_us = NowUs();
  beat.state = "running";
  beat.ledger_seq = ledger_seq_;
  beat.memory_bytes = ResidentMemoryBytes();
  beat.peak_memory_bytes = PeakMemoryBytes();
  beat.bytes_pulled = blobs_->bytes_pulled();
  beat.num_decode_failures = bus_.counters().num_decode_failures;
  beat.num_refused = bus_.counters().num_refused;
  if (fill_heartbeat_) fill_heartbeat_(&beat);
  if (beat.problem.empty()) beat.problem = ProblemOf(loop_);
  bus_.Publish(kHeartbeatChannel, beat);
}

void Node::NoteCommitted(const Fact& fact) {
  const fact_header_t& header = Header(fact);
  ledger_seq_ = std::max(ledger_seq_, header.seq);
  submitter_->OnCommitted(header);
  const auto observers = fact_observers_;  // a copy: an observer may end itself
  for (const auto& [id, observer] : observers) {
    if (fact_observers_.count(id)) observer(fact);
  }
}

int64_t Node::AddFactObserver(std::function<void(const Fact&)> observer) {
  fact_observers_[next_observer_] = std::move(observer);
  return next_observer_++;
}

namespace {

int Fail(const NodeOptions& options, const std::exception& error, int exit_code) {
  const std::string& name = options.instance.empty() ? options.service : options.instance;
  std::fprintf(stderr, "skein-%s (%s): %s\n", options.service.c_str(), name.c_str(), error.what());
  return exit_code;
}

}  // namespace

configuration_t ConfigurationOf(const NodeOptions& options) {
  configuration_t fact{};
  fact.service = options.service;
  fact.instance = options.instance.empty() ? options.service : options.instance;
  fact.text = options.configuration;
  fact.version = Version();
  fact.header.fact_id = ConfigurationFactId(fact.instance, fact.service, fact.version, fact.text);
  return fact;
}

int RunService(const NodeOptions& options, const std::function<void(Node&)>& body) {
  InitLog(options.instance.empty() ? options.service : options.instance, options.verbose);
  std::unique_ptr<Node> node;
  try {
    CapThreads(options.threads);
    node = std::make_unique<Node>(options);
  } catch (const std::invalid_argument& error) {
    return Fail(options, error, 2);
  } catch (const Interrupted&) {
    return 0;
  } catch (const std::exception& error) {
    return Fail(options, error, 1);
  }
  try {
    if (options.signer.role == Role::kWorker && !options.configuration.empty()) {
      node->submitter().Submit(ConfigurationOf(node->options()), [](const Submission&) {});
    }
    body(*node);
    return 0;
  } catch (const std::exception& error) {
    return Fail(options, error, 1);
  }
}

}  // namespace skein
