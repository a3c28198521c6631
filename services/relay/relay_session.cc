#include "relay/relay_session.h"

#include <unistd.h>

#include <stdexcept>

#include "auth/revocations.h"
#include "core/clock.h"
#include "core/counted.h"
#include "core/log.h"
#include "core/process.h"
#include "ledger/session_folder.h"

namespace skein {
namespace {

template <class T>
T Need(Result<T> result) {
  if (!result.ok()) throw std::runtime_error(result.error());
  return *std::move(result);
}

// As a viewer: of all that is said in a session, it may say its heartbeat.
SessionAccess OpenAccess(const NodeOptions& options) {
  const Session session = Need(OpenOrCreateSession(options.session_dir));
  return Need(OpenSessionKeys(session.paths.Keys().string(), session.session_id, Role::kViewer,
                              options.instance));
}

std::string CountOf(int64_t count, const char* what) {
  return count == 0 ? "" : ", " + std::to_string(count) + " " + what;
}

}  // namespace

RelaySession::RelaySession(const NodeOptions& options)
    : instance_(options.instance),
      url_(ParseLcmUrl(options.lcm_url)),
      auth_(AuthOf(options.auth, url_)),
      keys_dir_(SessionPaths{options.session_dir}.Keys().string()),
      access_(OpenAccess(options)) {
  if (!url_.goes_over_relay()) {
    throw std::invalid_argument("--lcm-url " + url_.ToString() +
                                ": give the session's URL, tcpq://HOST:PORT or tcpqs://HOST:PORT");
  }
  if (url_.provider != "tcpqs") return;
  certificate_ = Need(OpenRelayCertificate(keys_dir_));
  url_.pin = certificate_->pin;
  LogInfo("fingerprint of its certificate: {}", url_.pin);
}

std::optional<TlsContext> RelaySession::Tls() const {
  if (!certificate_) return std::nullopt;
  return TlsContext::ForRelay(*certificate_);
}

MessageSeal RelaySession::MakeSeal() const {
  MessageSeal seal(access_.trust, access_.credential, access_.used, NowUs);
  seal.SetRevoked(Revocations(keys_dir_));
  return seal;
}

std::unique_ptr<RelayGuard> RelaySession::MakeGuard() const {
  if (auth_ == Auth::kOff) return nullptr;
  return std::make_unique<RelayGuard>(MakeSeal(), auth_ == Auth::kWarn);
}

void RelaySession::Speak(PollLoop& loop, const std::vector<std::unique_ptr<Relay>>& relays) {
  bus_ = std::make_unique<Bus>(url_.ToString(), loop);
  bus_->SetSession(access_.trust.session_id);
  if (auth_ != Auth::kOff) {
    bus_->SetSeal(std::make_unique<MessageSeal>(MakeSeal()), auth_ == Auth::kWarn);
  }
  loop.AddTimer(kHeartbeatS,
                [this, &relays] { bus_->Publish(kHeartbeatChannel, Heartbeat(relays)); });
}

heartbeat_t RelaySession::Heartbeat(const std::vector<std::unique_ptr<Relay>>& relays) const {
  int num_clients = 0;
  RelayCounters sum;
  for (const auto& relay : relays) {
    const RelayCounters& counters = relay->counters();
    num_clients += relay->num_clients();
    sum.num_messages += counters.num_messages;
    sum.num_dropped += counters.num_dropped;
    sum.num_refused += counters.num_refused;
    sum.num_refused_subscriptions += counters.num_refused_subscriptions;
    sum.num_turned_away += counters.num_turned_away;
    sum.num_held_up += counters.num_held_up;
    sum.num_expelled += counters.num_expelled;
  }
  heartbeat_t beat{};
  beat.service = "relay";
  beat.instance = instance_;
  beat.host = HostName();
  beat.pid = static_cast<int32_t>(::getpid());
  beat.utime_us = NowUs();
  beat.state = Counted(static_cast<int64_t>(num_clients), "client") +
               CountOf(sum.num_dropped, "messages dropped for clients that do not keep up") +
               CountOf(sum.num_refused_subscriptions, "subscriptions refused") +
               CountOf(sum.num_turned_away, "connections turned away") +
               CountOf(sum.num_held_up, "times a client was read later, as it says too much") +
               CountOf(sum.num_expelled, "clients hung up on");
  beat.num_done = sum.num_messages;
  beat.memory_bytes = ResidentMemoryBytes();
  beat.peak_memory_bytes = PeakMemoryBytes();
  beat.num_refused = sum.num_refused;
  return beat;
}

}  // namespace skein
