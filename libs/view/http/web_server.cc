#include "http/web_server.h"

#include <algorithm>
#include <atomic>
#include <map>
#include <optional>
#include <thread>
#include <utility>

#include "core/attempt.h"
#include "core/clock.h"
#include "core/log.h"
#include "core/option_check.h"
#include "http/asio.h"
#include "http/connection_host.h"
#include "http/guests.h"
#include "http/http_connection.h"
#include "http/job_pool.h"
#include "http/page_socket.h"

namespace skein {
namespace {

constexpr int kKeptPlaces = 16;        // that doors leave to the own port, and others to operators
constexpr double kCheckPassesS = 0.5;  // the list of revoked names is read each second
constexpr double kAcceptPauseS = 0.1;  // where the process has no descriptor left
constexpr int kNumFileThreads = 2;     // that read at a time, but for those that the disk holds up

asio::ssl::context TlsOf(const WebCertificate& certificate) {
  asio::ssl::context context(asio::ssl::context::tls_server);
  context.set_options(asio::ssl::context::default_workarounds | asio::ssl::context::no_tlsv1 |
                      asio::ssl::context::no_tlsv1_1);
  const std::string& chain = certificate.chain_pem;
  const std::string& key = certificate.key_pem;
  context.use_certificate_chain(asio::buffer(chain.data(), chain.size()));
  context.use_private_key(asio::buffer(key.data(), key.size()), asio::ssl::context::pem);
  SSL_CTX_set_mode(context.native_handle(), SSL_MODE_RELEASE_BUFFERS);
  return context;
}

// An IPv6 address stands for its network of 64 bits: who has one address there has all.
std::string NetworkOf(const asio::ip::address& address) {
  if (!address.is_v6() || address.to_v6().is_v4_mapped()) return address.to_string();
  asio::ip::address_v6::bytes_type bytes = address.to_v6().to_bytes();
  std::fill(bytes.begin() + 8, bytes.end(), uint8_t{0});
  return asio::ip::address_v6(bytes).to_string();
}

}  // namespace

Status WebServerOptions::Check() const { return InRange("port", port, 0, 65535); }

class WebServer::Impl : public ConnectionHost, public std::enable_shared_from_this<Impl> {
 public:
  Impl(const WebServerOptions& options, const EventLog& log, HttpHandler handler, Uploads uploads)
      : options_(options), log_(log), handler_(std::move(handler)), uploads_(std::move(uploads)) {
    if (options_.access) guests_.emplace(options_.access->trust, options_.access->is_revoked);
    jobs_ = std::make_unique<JobPool>(kNumFileThreads, options_.max_connections);
  }

  Status Listen();
  void Start();
  void Stop();
  int port() const { return listeners_.front()->port; }
  std::vector<int> door_ports() const {
    std::vector<int> ports;
    for (size_t i = 1; i < listeners_.size(); ++i) ports.push_back(listeners_[i]->port);
    return ports;
  }

  void NoteEvents();
  void TellLatest(const std::string& topic, std::string text);
  int num_viewers() const { return num_viewers_; }
  int num_connections() const { return num_connections_; }

  const WebServerOptions& options() const override { return options_; }
  Visitor FindVisitor(const std::string& cookies, const std::string& authorization) const override;
  Status NoteVisitor(int64_t connection_id, const Visitor& visitor) override;
  std::string AgentOfPhoto(int64_t image_id) const override;
  void Handle(int64_t connection_id, const HttpRequest& request) override;
  std::shared_ptr<BodySink> MakeSink(const HttpRequest& request) override;
  BodySink::Next OnServer(int64_t connection_id, OnNext then) override;
  void RunJob(std::function<void()> job) override { jobs_->Run(std::move(job)); }
  void Upgrade(int64_t connection_id, WebStream stream, UpgradeRequest request) override;
  void OnClosed(int64_t connection_id) override;
  int64_t sent_seq() const override { return sent_seq_; }

 private:
  // Goes on once; what ends without, e.g. by an exception, has failed.
  class Pending;

  // What is known of whom a connection is for.
  struct Place {
    std::string address;  // of the peer
    bool is_public = false;
    Visitor visitor;  // of its latest request

    std::string Owner() const { return visitor.name.empty() ? address : "pass " + visitor.name; }
  };

  // A port that is listened on.
  struct Listener {
    explicit Listener(asio::io_context& context) : acceptor(context), pause(context) {}
    tcp::acceptor acceptor;
    asio::steady_timer pause;
    std::optional<asio::ssl::context> tls;
    Door door;
    int port = 0;
  };

  Status Open(const std::string& address, int port, const std::string& option);
  void Run();
  void Accept(Listener& listener);
  void OnAccepted(tcp::socket socket, const Door& door);
  using Chooses = std::function<bool(const Place&)>;
  static bool Anyone(const Place&) { return true; }
  static bool IsPublicNoOperator(const Place& place) {
    return place.is_public && place.visitor.role != Role::kOperator;
  }
  int CountPlaces(const Chooses& chooses) const;
  bool FindPlace(const Place& place);
  bool CloseIdle(const Chooses& chooses);
  template <class Connection, class Since>
  std::shared_ptr<Connection> FindOldestOfMost(
      const std::map<int64_t, std::shared_ptr<Connection>>& connections, const Since& since) const;
  bool CloseOldestAnswer(const Chooses& chooses);
  bool CloseOldestPage(const Chooses& chooses);
  void Count();
  void OnNote();
  void Flush();
  void CheckPasses();

  const WebServerOptions options_;
  const EventLog& log_;
  const HttpHandler handler_;
  const Uploads uploads_;
  std::optional<Guests> guests_;
  asio::io_context context_{1};                       // before what waits in it
  std::vector<std::unique_ptr<Listener>> listeners_;  // the server's own port first
  asio::steady_timer gather_{context_};
  asio::steady_timer check_passes_{context_};

  int64_t next_id_ = 1;
  std::map<int64_t, std::shared_ptr<HttpConnection>> connections_;
  std::map<int64_t, std::shared_ptr<PageSocket>> pages_;
  std::map<int64_t, Place> places_;           // of connections_ and pages_
  std::map<std::string, SharedText> latest_;  // by topic
  int64_t sent_seq_ = 0;
  double flushed_s_ = 0;
  bool gathering_ = false;
  std::atomic<bool> noted_{false};
  std::atomic<int> num_viewers_{0};
  std::atomic<int> num_connections_{0};
  std::thread thread_;
  std::unique_ptr<JobPool> jobs_;  // read files; end after the thread that gives them
};

class WebServer::Impl::Pending {
 public:
  Pending(std::weak_ptr<Impl> impl, int64_t connection_id, OnNext then)
      : impl_(std::move(impl)), connection_id_(connection_id), then_(std::move(then)) {}
  ~Pending() { GoOn(HttpError(500, "the request was not answered; the log may say why")); }

  void GoOn(std::optional<HttpResponse> answer) {
    if (gone_on_.exchange(true)) return;
    const std::shared_ptr<Impl> impl = impl_.lock();
    if (impl == nullptr) return;
    asio::post(impl->context_, [impl = impl.get(), id = connection_id_, then = std::move(then_),
                                answer = std::move(answer)]() mutable {
      const auto connection = impl->connections_.find(id);
      if (connection == impl->connections_.end()) return;
      const std::shared_ptr<HttpConnection> kept = connection->second;
      then(*kept, std::move(answer));
    });
  }

 private:
  const std::weak_ptr<Impl> impl_;
  const int64_t connection_id_;
  OnNext then_;
  std::atomic<bool> gone_on_{false};
};

Status WebServer::Impl::Listen() {
  if (const Status opened = Open(options_.address, options_.port, "--port"); !opened.ok()) {
    return opened;
  }
  if (!options_.access) return Status::Ok();
  for (const PublicDoor& door : options_.access->doors) {
    const char* option = door.certificate ? "--public-port" : "--plain-port";
    if (const Status opened = Open(door.address, door.port, option); !opened.ok()) return opened;
    Listener& listener = *listeners_.back();
    listener.door.is_public = true;
    if (!door.certificate) continue;
    try {
      listener.tls = TlsOf(*door.certificate);
    } catch (const boost::system::system_error& error) {
      return DataLoss(std::string("the certificate for browsers is of no use: ") + error.what());
    }
    listener.door.tls = &*listener.tls;
  }
  return Status::Ok();
}

Status WebServer::Impl::Open(const std::string& ip, int port, const std::string& option) {
  ErrorCode error;
  const asio::ip::address address = asio::ip::make_address(ip, error);
  if (error) return InvalidArgument("--address " + ip + ": give an IP address");
  const tcp::endpoint endpoint(address, static_cast<uint16_t>(port));
  listeners_.push_back(std::make_unique<Listener>(context_));
  tcp::acceptor& acceptor = listeners_.back()->acceptor;
  acceptor.open(endpoint.protocol(), error);
  if (!error) acceptor.set_option(asio::socket_base::reuse_address(true), error);
  if (!error) acceptor.bind(endpoint, error);
  if (!error) acceptor.listen(asio::socket_base::max_listen_connections, error);
  const std::string where = ip + " port " + std::to_string(port);
  if (error == asio::error::address_in_use) {
    return AlreadyExists(where + " is taken: give another one with " + option);
  }
  if (error) return Unavailable("cannot listen on " + where + ": " + error.message());
  listeners_.back()->port = acceptor.local_endpoint().port();
  return Status::Ok();
}

void WebServer::Impl::Start() {
  sent_seq_ = log_.head();
  for (const auto& listener : listeners_) Accept(*listener);
  if (guests_) CheckPasses();
  thread_ = std::thread([this] { Run(); });
}

// A request that fails unforeseen ends nobody else's.
void WebServer::Impl::Run() {
  while (!context_.stopped()) {
    try {
      context_.run();
    } catch (const std::exception& error) {
      LogError("web server: {}", error.what());
    }
  }
}

void WebServer::Impl::Stop() {
  context_.stop();
  if (thread_.joinable()) thread_.join();
  jobs_.reset();
}

void WebServer::Impl::Accept(Listener& listener) {
  listener.acceptor.async_accept([this, &listener](ErrorCode error, tcp::socket socket) {
    if (!error) {
      OnAccepted(std::move(socket), listener.door);
      return Accept(listener);
    }
    if (error == asio::error::operation_aborted) return;
    listener.pause.expires_after(Milliseconds(kAcceptPauseS));
    listener.pause.async_wait([this, &listener](ErrorCode cancelled) {
      if (!cancelled) Accept(listener);
    });
  });
}

void WebServer::Impl::OnAccepted(tcp::socket socket, const Door& door) {
  ErrorCode ignored;
  socket.set_option(tcp::no_delay(true), ignored);
  const Place place{NetworkOf(socket.remote_endpoint(ignored).address()), door.is_public, {}};
  const bool has_room = FindPlace(place);
  const int64_t id = next_id_++;
  const auto connection = std::make_shared<HttpConnection>(*this, id, std::move(socket), door);
  connections_[id] = connection;
  places_[id] = place;
  Count();
  has_room ? connection->Start() : connection->Refuse();
}

int WebServer::Impl::CountPlaces(const Chooses& chooses) const {
  return static_cast<int>(std::count_if(places_.begin(), places_.end(),
                                        [&](const auto& place) { return chooses(place.second); }));
}

// Who comes by a door takes no place of the own port, nor more than an address may have.
bool WebServer::Impl::FindPlace(const Place& place) {
  const auto is_public = [](const Place& other) { return other.is_public; };
  const auto is_neighbour = [&](const Place& other) {
    return other.is_public && other.address == place.address;
  };
  const bool is_full =
      place.is_public && CountPlaces(is_neighbour) >= options_.bounds.max_of_address;
  if (is_full && !CloseIdle(is_neighbour) && !CloseOldestAnswer(is_neighbour)) return false;
  const int limit = options_.max_connections;
  const bool has_room = static_cast<int>(places_.size()) < limit;
  if (!place.is_public) return has_room || CloseIdle(Anyone) || CloseOldestPage(Anyone);
  if (has_room && CountPlaces(is_public) < limit - kKeptPlaces) return true;
  return CloseIdle(is_public) || CloseOldestAnswer(is_public) ||
         CloseOldestPage(IsPublicNoOperator);
}

// Who is no operator leaves places to operators; a pass has no more than its share.
Status WebServer::Impl::NoteVisitor(int64_t connection_id, const Visitor& visitor) {
  const auto found = places_.find(connection_id);
  if (found == places_.end()) return Unavailable("the connection is closed");
  found->second.visitor = visitor;
  if (!IsPublicNoOperator(found->second)) return Status::Ok();
  const int limit = options_.max_connections - 2 * kKeptPlaces;
  if (CountPlaces(IsPublicNoOperator) > limit && !CloseIdle(IsPublicNoOperator) &&
      !CloseOldestAnswer(IsPublicNoOperator) && !CloseOldestPage(IsPublicNoOperator)) {
    return Unavailable("too many visitors: try again later");
  }
  const auto has_pass = [&](const Place& place) {
    return place.is_public && place.visitor.name == visitor.name;
  };
  if (!visitor.name.empty() && CountPlaces(has_pass) > options_.bounds.max_of_pass &&
      !CloseIdle(has_pass)) {
    return Unavailable("too many connections by this invitation: close other tabs of this view");
  }
  return Status::Ok();
}

// Of those chosen, whoever has been without a request for longest goes. Where all have one: whose
// answer has been due for longest, if for longer than a connection may be idle.
bool WebServer::Impl::CloseIdle(const Chooses& chooses) {
  std::shared_ptr<HttpConnection> idlest, slowest;
  for (const auto& [id, connection] : connections_) {
    if (!chooses(places_.at(id))) continue;
    const auto since_s = connection->waiting_since_s(), due_s = connection->due_since_s();
    if (since_s && (!idlest || *since_s < *idlest->waiting_since_s())) idlest = connection;
    if (due_s && (!slowest || *due_s < *slowest->due_since_s())) slowest = connection;
  }
  const bool is_late = slowest && MonotonicS() - *slowest->due_since_s() > options_.bounds.idle_s;
  if (idlest == nullptr && !is_late) return false;
  (idlest != nullptr ? idlest : slowest)->Close();
  return true;
}

// From `connections`: those with a `since`, a time or an order, and of these the earliest one of
// the owner with most places. Null if no owner has more than one.
template <class Connection, class Since>
std::shared_ptr<Connection> WebServer::Impl::FindOldestOfMost(
    const std::map<int64_t, std::shared_ptr<Connection>>& connections, const Since& since) const {
  std::map<std::string, int> num_of;
  for (const auto& [id, place] : places_) ++num_of[place.Owner()];
  std::shared_ptr<Connection> oldest;
  int most = 1;
  double earliest = 0;
  for (const auto& [id, connection] : connections) {
    const Place& place = places_.at(id);
    const std::optional<double> at = since(id, place, *connection);
    if (!at) continue;
    const int num = num_of[place.Owner()];
    if (num <= most && !(oldest && num == most && *at < earliest)) continue;
    oldest = connection;
    most = num;
    earliest = *at;
  }
  return oldest;
}

// An answer that has been going out for longest, to a visitor who shows no pass: whoever takes a
// page's file byte by byte keeps a place so long.
bool WebServer::Impl::CloseOldestAnswer(const Chooses& chooses) {
  const auto oldest = FindOldestOfMost(
      connections_, [&](int64_t, const Place& place, const HttpConnection& connection) {
        const bool is_chosen = place.visitor.name.empty() && chooses(place);
        return is_chosen ? connection.answering_since_s() : std::nullopt;
      });
  if (oldest != nullptr) oldest->Close();
  return oldest != nullptr;
}

// Pages come in the order of their ids.
bool WebServer::Impl::CloseOldestPage(const Chooses& chooses) {
  const auto oldest = FindOldestOfMost(
      pages_, [&](int64_t id, const Place& place, const PageSocket&) -> std::optional<double> {
        if (!chooses(place)) return std::nullopt;
        return static_cast<double>(id);
      });
  if (oldest != nullptr) oldest->Close();
  return oldest != nullptr;
}

void WebServer::Impl::Count() {
  num_viewers_ = static_cast<int>(pages_.size());
  num_connections_ = static_cast<int>(connections_.size() + pages_.size());
}

Visitor WebServer::Impl::FindVisitor(const std::string& cookies,
                                     const std::string& authorization) const {
  return guests_ ? guests_->Find(cookies, authorization, NowUs() / 1'000'000) : Visitor();
}

std::string WebServer::Impl::AgentOfPhoto(int64_t image_id) const {
  return uploads_.agent_of_photo ? uploads_.agent_of_photo(image_id) : "";
}

std::shared_ptr<BodySink> WebServer::Impl::MakeSink(const HttpRequest& request) {
  return uploads_.make_sink ? uploads_.make_sink(request) : nullptr;
}

BodySink::Next WebServer::Impl::OnServer(int64_t connection_id, OnNext then) {
  const auto pending = std::make_shared<Pending>(weak_from_this(), connection_id, std::move(then));
  return [pending](std::optional<HttpResponse> answer) { pending->GoOn(std::move(answer)); };
}

void WebServer::Impl::Handle(int64_t connection_id, const HttpRequest& request) {
  if (request.path == "/api/enter" && request.method == "POST") {
    const auto connection = connections_.find(connection_id);
    if (connection == connections_.end()) return;
    return connection->second->Answer(
        guests_ ? guests_->Enter(request.body, request.is_encrypted, NowUs() / 1'000'000)
                : HttpError(404, "no pass counts here"));
  }
  const BodySink::Next answer =
      OnServer(connection_id, [](HttpConnection& connection, std::optional<HttpResponse> response) {
        connection.Answer(std::move(response).value());
      });
  const Status handled = Attempt(
      [&] { handler_(request, [answer](HttpResponse response) { answer(std::move(response)); }); });
  if (!handled.ok()) LogError("a request failed: {}", handled.error());
}

void WebServer::Impl::Upgrade(int64_t connection_id, WebStream stream, UpgradeRequest request) {
  connections_.erase(connection_id);
  const auto page = std::make_shared<PageSocket>(*this, connection_id, std::move(stream));
  pages_[connection_id] = page;
  Count();
  page->Start(std::move(request), latest_);
}

void WebServer::Impl::OnClosed(int64_t connection_id) {
  connections_.erase(connection_id);
  pages_.erase(connection_id);
  places_.erase(connection_id);
  Count();
}

// A WebSocket lives for as long as its page, an upload or a download for long: a pass may end
// before.
void WebServer::Impl::CheckPasses() {
  const std::map<int64_t, Place> places = places_;  // one that is refused may leave
  for (const auto& [id, place] : places) {
    if (place.visitor.name.empty()) continue;
    const Status holds = guests_->Check(place.visitor, NowUs() / 1'000'000);
    if (holds.ok()) continue;
    const auto page = pages_.find(id);
    if (page != pages_.end()) page->second->Refuse(holds.error());
    const auto connection = connections_.find(id);
    if (connection != connections_.end()) connection->second->Close();
  }
  check_passes_.expires_after(Milliseconds(kCheckPassesS));
  check_passes_.async_wait([this](ErrorCode error) {
    if (!error) CheckPasses();
  });
}

void WebServer::Impl::NoteEvents() {
  if (noted_.exchange(true)) return;
  asio::post(context_, [this] { OnNote(); });
}

// The first event after a pause goes out at once, those that follow are gathered.
void WebServer::Impl::OnNote() {
  noted_ = false;
  if (gathering_) return;
  const double wait_s = flushed_s_ + options_.bounds.gather_s - MonotonicS();
  if (wait_s <= 0) return Flush();
  gathering_ = true;
  gather_.expires_after(std::chrono::microseconds(static_cast<int64_t>(wait_s * 1e6)));
  gather_.async_wait([this](ErrorCode error) {
    gathering_ = false;
    if (!error) Flush();
  });
}

void WebServer::Impl::Flush() {
  flushed_s_ = MonotonicS();
  const int64_t head = log_.head();
  if (head <= sent_seq_) return;
  const int64_t from_seq = std::exchange(sent_seq_, head) + 1;
  if (pages_.empty()) return;
  const EventLog::Page page = log_.Get(from_seq, EventLog::kMaxEvents, head);
  if (page.events.empty()) return;
  // Where they are more than a page is sent at once, it pulls them.
  const SharedText message =
      page.next <= head
          ? nullptr
          : std::make_shared<const std::string>(
                "{\"type\":\"events\",\"after\":" + std::to_string(from_seq - 1) +
                ",\"head\":" + std::to_string(head) + ",\"events\":[" + page.events + "]}");
  const auto pages = pages_;  // one that fails leaves
  for (const auto& [id, socket] : pages) socket->SendEvents(message);
}

void WebServer::Impl::TellLatest(const std::string& topic, std::string text) {
  asio::post(context_, [this, topic, text = std::make_shared<const std::string>(std::move(text))] {
    latest_[topic] = text;
    const auto pages = pages_;
    for (const auto& [id, page] : pages) page->SendLatest(topic, text);
  });
}

WebServer::WebServer(std::shared_ptr<Impl> impl) : impl_(std::move(impl)) {}

Result<std::unique_ptr<WebServer>> WebServer::Start(const WebServerOptions& options,
                                                    const EventLog& log, HttpHandler handler,
                                                    Uploads uploads) {
  const auto impl = std::make_shared<Impl>(options, log, std::move(handler), std::move(uploads));
  if (const Status listening = impl->Listen(); !listening.ok()) return listening;
  impl->Start();
  return std::unique_ptr<WebServer>(new WebServer(impl));
}

WebServer::~WebServer() { impl_->Stop(); }

int WebServer::port() const { return impl_->port(); }
std::vector<int> WebServer::door_ports() const { return impl_->door_ports(); }
void WebServer::NoteEvents() { impl_->NoteEvents(); }
void WebServer::TellLatest(const std::string& topic, std::string text) {
  impl_->TellLatest(topic, std::move(text));
}
int WebServer::num_viewers() const { return impl_->num_viewers(); }
int WebServer::num_connections() const { return impl_->num_connections(); }

}  // namespace skein
