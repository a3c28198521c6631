#include "web/web_server.h"

#include <atomic>
#include <map>
#include <thread>
#include <utility>

#include "core/clock.h"
#include "core/log.h"
#include "core/option_check.h"
#include "web/asio.h"
#include "web/connection_host.h"
#include "web/http_connection.h"
#include "web/page_socket.h"

namespace skein {
namespace {

constexpr double kAcceptPauseS = 0.1;  // where the process has no descriptor left

}  // namespace

Status WebServerOptions::Check() const {
  return FirstError(
      {InRange("port", port, 0, 65535), InRange("max_connections", max_connections, 1, 10'000),
       InRange("max_header_bytes", max_header_bytes, 256, 1 << 20),
       InRange("idle", idle_s, 0.01, 86400.0), InRange("stalled", stalled_s, 0.01, 86400.0),
       InRange("gather", gather_s, 0.0, 10.0)});
}

class WebServer::Impl : public ConnectionHost, public std::enable_shared_from_this<Impl> {
 public:
  Impl(const WebServerOptions& options, const EventLog& log, HttpHandler handler)
      : options_(options), log_(log), handler_(std::move(handler)) {}

  Status Listen();
  void Start();
  void Stop();
  int port() const { return port_; }

  void NoteEvents();
  void TellLatest(const std::string& topic, std::string text);
  int num_viewers() const { return num_viewers_; }
  int num_connections() const { return num_connections_; }

  const WebServerOptions& options() const override { return options_; }
  void Handle(int64_t connection_id, const HttpRequest& request) override;
  void Upgrade(int64_t connection_id, beast::tcp_stream stream, UpgradeRequest request) override;
  void OnClosed(int64_t connection_id) override;
  int64_t sent_seq() const override { return sent_seq_; }

 private:
  // Answers once; a handler that forgets to answer has failed.
  class Reply;

  void Run();
  void Accept();
  void OnAccepted(tcp::socket socket);
  bool MakeRoom();
  void Count();
  void OnNote();
  void Flush();

  const WebServerOptions options_;
  const EventLog& log_;
  const HttpHandler handler_;
  asio::io_context context_{1};  // before what waits in it
  tcp::acceptor acceptor_{context_};
  asio::steady_timer pause_{context_};
  asio::steady_timer gather_{context_};
  int port_ = 0;

  int64_t next_id_ = 1;
  std::map<int64_t, std::shared_ptr<HttpConnection>> connections_;
  std::map<int64_t, std::shared_ptr<PageSocket>> pages_;
  std::map<std::string, SharedText> latest_;  // by topic
  int64_t sent_seq_ = 0;
  double flushed_s_ = 0;
  bool gathering_ = false;
  std::atomic<bool> noted_{false};
  std::atomic<int> num_viewers_{0};
  std::atomic<int> num_connections_{0};
  std::thread thread_;
};

class WebServer::Impl::Reply {
 public:
  Reply(std::weak_ptr<Impl> impl, int64_t connection_id)
      : impl_(std::move(impl)), connection_id_(connection_id) {}
  ~Reply() { Send(HttpError(500, "the request was not answered; the log may say why")); }

  void Send(HttpResponse response) {
    if (sent_.exchange(true)) return;
    const std::shared_ptr<Impl> impl = impl_.lock();
    if (impl == nullptr) return;
    asio::post(impl->context_,
               [impl = impl.get(), id = connection_id_, response = std::move(response)]() mutable {
                 const auto connection = impl->connections_.find(id);
                 if (connection == impl->connections_.end()) return;
                 const std::shared_ptr<HttpConnection> kept = connection->second;
                 kept->Answer(std::move(response));
               });
  }

 private:
  const std::weak_ptr<Impl> impl_;
  const int64_t connection_id_;
  std::atomic<bool> sent_{false};
};

Status WebServer::Impl::Listen() {
  ErrorCode error;
  const asio::ip::address address = asio::ip::make_address(options_.address, error);
  if (error) return InvalidArgument("--address " + options_.address + ": give an IP address");
  const tcp::endpoint endpoint(address, static_cast<uint16_t>(options_.port));
  acceptor_.open(endpoint.protocol(), error);
  if (!error) acceptor_.set_option(asio::socket_base::reuse_address(true), error);
  if (!error) acceptor_.bind(endpoint, error);
  if (!error) acceptor_.listen(asio::socket_base::max_listen_connections, error);
  const std::string where = options_.address + " port " + std::to_string(options_.port);
  if (error == asio::error::address_in_use) {
    return AlreadyExists(where + " is taken: give another one with --port");
  }
  if (error) return Unavailable("cannot listen on " + where + ": " + error.message());
  port_ = acceptor_.local_endpoint().port();
  return Status::Ok();
}

void WebServer::Impl::Start() {
  sent_seq_ = log_.head();
  Accept();
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
}

void WebServer::Impl::Accept() {
  acceptor_.async_accept([this](ErrorCode error, tcp::socket socket) {
    if (!error) {
      OnAccepted(std::move(socket));
      return Accept();
    }
    if (error == asio::error::operation_aborted) return;
    pause_.expires_after(Milliseconds(kAcceptPauseS));
    pause_.async_wait([this](ErrorCode cancelled) {
      if (!cancelled) Accept();
    });
  });
}

void WebServer::Impl::OnAccepted(tcp::socket socket) {
  ErrorCode ignored;
  socket.set_option(tcp::no_delay(true), ignored);
  const bool has_room = MakeRoom();
  const int64_t id = next_id_++;
  const auto connection = std::make_shared<HttpConnection>(*this, id, std::move(socket));
  connections_[id] = connection;
  Count();
  has_room ? connection->Start() : connection->Refuse();
}

// Where all places are taken, whoever has been without a request for longest goes.
bool WebServer::Impl::MakeRoom() {
  const auto limit = static_cast<size_t>(options_.max_connections);
  if (connections_.size() + pages_.size() < limit) return true;
  std::shared_ptr<HttpConnection> idlest;
  for (const auto& [id, connection] : connections_) {
    const auto since_s = connection->waiting_since_s();
    if (since_s && (idlest == nullptr || *since_s < *idlest->waiting_since_s()))
      idlest = connection;
  }
  if (idlest == nullptr) return false;
  idlest->Close();
  return true;
}

void WebServer::Impl::Count() {
  num_viewers_ = static_cast<int>(pages_.size());
  num_connections_ = static_cast<int>(connections_.size() + pages_.size());
}

void WebServer::Impl::Handle(int64_t connection_id, const HttpRequest& request) {
  const auto reply = std::make_shared<Reply>(weak_from_this(), connection_id);
  handler_(request, [reply](HttpResponse response) { reply->Send(std::move(response)); });
}

void WebServer::Impl::Upgrade(int64_t connection_id, beast::tcp_stream stream,
                              UpgradeRequest request) {
  connections_.erase(connection_id);
  const auto page = std::make_shared<PageSocket>(*this, connection_id, std::move(stream));
  pages_[connection_id] = page;
  Count();
  page->Start(std::move(request), latest_);
}

void WebServer::Impl::OnClosed(int64_t connection_id) {
  connections_.erase(connection_id);
  pages_.erase(connection_id);
  Count();
}

void WebServer::Impl::NoteEvents() {
  if (noted_.exchange(true)) return;
  asio::post(context_, [this] { OnNote(); });
}

// The first event after a pause goes out at once, those that follow are gathered.
void WebServer::Impl::OnNote() {
  noted_ = false;
  if (gathering_) return;
  const double wait_s = flushed_s_ + options_.gather_s - MonotonicS();
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
  const SharedText message = page.next <= head
                                 ? nullptr
                                 : std::make_shared<const std::string>(
                                       "{\"type\":\"events\",\"events\":[" + page.events + "]}");
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
                                                    const EventLog& log, HttpHandler handler) {
  const auto impl = std::make_shared<Impl>(options, log, std::move(handler));
  if (const Status listening = impl->Listen(); !listening.ok()) return listening;
  impl->Start();
  return std::unique_ptr<WebServer>(new WebServer(impl));
}

WebServer::~WebServer() { impl_->Stop(); }

int WebServer::port() const { return impl_->port(); }
void WebServer::NoteEvents() { impl_->NoteEvents(); }
void WebServer::TellLatest(const std::string& topic, std::string text) {
  impl_->TellLatest(topic, std::move(text));
}
int WebServer::num_viewers() const { return impl_->num_viewers(); }
int WebServer::num_connections() const { return impl_->num_connections(); }

}  // namespace skein
