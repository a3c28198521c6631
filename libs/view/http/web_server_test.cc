#include "http/web_server.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <boost/asio/read.hpp>
#include <boost/asio/ssl.hpp>
#include <boost/asio/write.hpp>
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <new>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <thread>
#include <utility>
#include <vector>

#include "auth/session_keys.h"
#include "auth/web_pass.h"
#include "core/clock.h"
#include "http/asio.h"
#include "http/job_pool.h"
#include "testing/test_folder.h"

namespace skein::web_server_test {

using nlohmann::json;

constexpr double kDeadlineS = 20;

bool WaitFor(const std::function<bool()>& done) {
  const double until_s = MonotonicS() + kDeadlineS;
  while (!done()) {
    if (MonotonicS() > until_s) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return true;
}

// A TCP connection that says and hears bytes.
class RawClient {
 public:
  explicit RawClient(int port) : fd_(socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const timeval timeout{static_cast<int>(kDeadlineS), 0};
    setsockopt(fd_, SOL_SOCKET, SO_RCVTIMEO, &timeout, sizeof(timeout));
    connected_ = connect(fd_, reinterpret_cast<sockaddr*>(&address), sizeof(address)) == 0;
  }
  ~RawClient() { close(fd_); }
  RawClient(const RawClient&) = delete;
  RawClient& operator=(const RawClient&) = delete;

  bool connected() const { return connected_; }
  void Say(const std::string& text) {
    size_t said = 0;
    while (said < text.size()) {
      const ssize_t n = send(fd_, text.data() + said, text.size() - said, MSG_NOSIGNAL);
      if (n <= 0) return;
      said += static_cast<size_t>(n);
    }
  }
  // Until the server closes.
  std::string HearAll() {
    std::string heard;
    char part[4096];
    ssize_t n = 0;
    while ((n = recv(fd_, part, sizeof(part), 0)) > 0) heard.append(part, static_cast<size_t>(n));
    return heard;
  }
  bool IsClosed() {
    char byte = 0;
    return recv(fd_, &byte, 1, 0) <= 0;
  }
  // Whether the server has closed; waits for nothing.
  bool HasHungUp() const {
    char byte = 0;
    const ssize_t n = recv(fd_, &byte, 1, MSG_PEEK | MSG_DONTWAIT);
    return n == 0 || (n < 0 && errno != EAGAIN);
  }
  // Hears up to the end of an answer's header.
  std::string HearHeader() {
    std::string heard;
    char byte = 0;
    while (heard.find("\r\n\r\n") == std::string::npos && recv(fd_, &byte, 1, 0) == 1) {
      heard += byte;
    }
    return heard;
  }

 private:
  const int fd_;
  bool connected_ = false;
};

class WebServerTest : public ::testing::Test {
 protected:
  WebServerTest() { options_.port = 0; }

  void Start() {
    auto server = WebServer::Start(
        options_, log_,
        [this](const HttpRequest& request, const Respond& respond) {
          ++num_handled_;
          if (request.path == "/never") return;
          if (request.path == "/throws") throw std::runtime_error("no such index");
          if (request.path == "/kept") {
            kept_ = respond;
            return;
          }
          HttpResponse response = JsonResponse("\"" + request.path + "\"");
          if (request.path == "/chunk") {
            response.bytes = std::make_shared<const Bytes>(Bytes{'0', '1', '2', '3', '4', '5'});
            response.ranges = true;
            response.immutable = true;
          }
          response.file_root = folder_.path();
          if (request.path == "/file") response.file = folder_ / "file.bin";
          if (request.path == "/small") response.file = folder_ / "small.bin";
          if (request.path == "/large") {
            response.bytes = std::make_shared<const Bytes>(Bytes(size_t{50} << 20, 'x'));
          }
          respond(response);
        },
        uploads_);
    ASSERT_TRUE(server.ok()) << server.error();
    server_ = std::move(*server);
  }

  int port() const { return server_->port(); }
  std::string Host() const { return "127.0.0.1:" + std::to_string(port()); }
  // The whole answer to a request of these lines.
  std::string Ask(const std::string& first_line, const std::string& headers = "") {
    RawClient client(port());
    client.Say(first_line + " HTTP/1.1\r\nHost: " + Host() + "\r\nConnection: close\r\n" + headers +
               "\r\n");
    return client.HearAll();
  }
  static int StatusOf(const std::string& answer) {
    return answer.compare(0, 9, "HTTP/1.1 ") == 0 ? std::stoi(answer.substr(9, 3)) : 0;
  }
  static std::string BodyOf(const std::string& answer) {
    const size_t end = answer.find("\r\n\r\n");
    return end == std::string::npos ? "" : answer.substr(end + 4);
  }
  // Says `begin`, then `more` piece by piece, until the server hangs up. False: it does not.
  static bool HangsUpOn(int port, const std::string& begin, const std::string& more) {
    RawClient client(port);
    client.Say(begin);
    return WaitFor([&] {
      client.Say(more);
      return client.HasHungUp();
    });
  }
  // A file that is more than the kernel takes for a client that reads nothing.
  void MakeLargeFile() const {
    std::ofstream(folder_ / "file.bin").close();
    std::filesystem::resize_file(folder_ / "file.bin", size_t{64} << 20);
  }
  // That the server answers a newcomer.
  void ExpectAlive() { EXPECT_EQ(StatusOf(Ask("GET /alive")), 200); }

  TestFolder folder_;
  WebServerOptions options_;
  EventLog log_;
  std::atomic<int> num_handled_{0};
  Uploads uploads_;
  Respond kept_;
  std::unique_ptr<WebServer> server_;
};

TEST_F(WebServerTest, AnswersWithTheHeadersOfACarefulServer) {
  Start();
  const std::string answer = Ask("GET /some/path?x=1");
  EXPECT_EQ(StatusOf(answer), 200);
  EXPECT_EQ(BodyOf(answer), "\"/some/path\"");
  for (const char* header :
       {"Content-Security-Policy: default-src 'self'; img-src 'self' blob: data:; "
        "style-src 'self'; script-src 'self'",
        "X-Content-Type-Options: nosniff", "Referrer-Policy: no-referrer",
        "Cross-Origin-Resource-Policy: same-origin", "Content-Type: application/json"}) {
    EXPECT_NE(answer.find(header), std::string::npos) << header;
  }
}

TEST_F(WebServerTest, AnswersARequestOnWhichAnExceptionComesAndGoesOn) {
  Start();
  EXPECT_EQ(StatusOf(Ask("GET /throws")), 500);
  ExpectAlive();
}

TEST_F(WebServerTest, HeadGivesNoBody) {
  Start();
  const std::string answer = Ask("HEAD /chunk");
  EXPECT_EQ(StatusOf(answer), 200);
  EXPECT_NE(answer.find("Content-Length: 6"), std::string::npos);
  EXPECT_EQ(BodyOf(answer), "");
}

TEST_F(WebServerTest, GivesFilesWhole) {
  Start();
  EXPECT_EQ(StatusOf(Ask("GET /file")), 404) << "it is not there";
  const std::string content(300'000, 'y');
  std::ofstream(folder_ / "file.bin") << content;
  EXPECT_TRUE(BodyOf(Ask("GET /file")) == content);
  const std::string head = Ask("HEAD /file");
  EXPECT_NE(head.find("Content-Length: 300000"), std::string::npos);
  EXPECT_EQ(BodyOf(head), "");
}

TEST_F(WebServerTest, GivesAFileOfManyPartsAndAnEmptyOne) {
  Start();
  std::string content(3'000'000, 'y');
  for (size_t i = 0; i < content.size(); i += 7) content[i] = static_cast<char>('a' + i % 26);
  std::ofstream(folder_ / "file.bin") << content;
  EXPECT_TRUE(BodyOf(Ask("GET /file")) == content);
  std::ofstream(folder_ / "small.bin").close();
  const std::string empty = Ask("GET /small");
  EXPECT_EQ(StatusOf(empty), 200);
  EXPECT_NE(empty.find("Content-Length: 0"), std::string::npos);
}

TEST_F(WebServerTest, GivesNothingButRegularFilesBelowTheirFolder) {
  Start();
  ASSERT_EQ(mkfifo((folder_ / "file.bin").c_str(), 0600), 0);
  EXPECT_EQ(StatusOf(Ask("GET /file")), 404) << "a FIFO that nobody writes to";
  std::filesystem::create_symlink("/etc/passwd", folder_ / "small.bin");
  const std::string answer = Ask("GET /small");
  EXPECT_EQ(StatusOf(answer), 404);
  EXPECT_EQ(answer.find("root:"), std::string::npos);
}

TEST_F(WebServerTest, WhoseAnswerIsLateMakesRoom) {
  options_.max_connections = 1;
  options_.bounds.idle_s = 0.3;
  Start();
  RawClient client(port());
  client.Say("GET /kept HTTP/1.1\r\nHost: " + Host() + "\r\n\r\n");
  ASSERT_TRUE(WaitFor([this] { return num_handled_ == 1; }));
  EXPECT_TRUE(WaitFor([this] { return StatusOf(Ask("GET /alive")) == 200; }));
  EXPECT_TRUE(client.IsClosed());
}

TEST_F(WebServerTest, GivesPartsOfABody) {
  Start();
  std::string answer = Ask("GET /chunk", "Range: bytes=2-3\r\n");
  EXPECT_EQ(StatusOf(answer), 206);
  EXPECT_EQ(BodyOf(answer), "23");
  EXPECT_NE(answer.find("Content-Range: bytes 2-3/6"), std::string::npos);
  EXPECT_NE(answer.find("immutable"), std::string::npos);
  answer = Ask("GET /chunk", "Range: bytes=6-\r\n");
  EXPECT_EQ(StatusOf(answer), 416);
  EXPECT_NE(answer.find("Content-Range: bytes */6"), std::string::npos);
  EXPECT_EQ(StatusOf(Ask("GET /other", "Range: bytes=0-0\r\n")), 200) << "JSON has no parts";
}

TEST_F(WebServerTest, BadRequestsAreRefusedWithALine) {
  Start();
  const std::vector<std::pair<std::string, int>> requests = {
      {"POST / HTTP/1.1\r\nHost: " + Host() + "\r\nContent-Length: 3\r\n\r\nabc", 405},
      {"DELETE / HTTP/1.1\r\nHost: " + Host() + "\r\n\r\n", 405},
      {"GET / HTTP/1.1\r\nHost: " + Host() + "\r\nContent-Length: 3\r\n\r\nabc", 413},
      {"GET / HTTP/1.1\r\nHost: " + Host() + "\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n",
       413},
      {"GET / HTTP/1.1\r\n\r\n", 403},
      {"GET / HTTP/1.1\r\nHost: evil.example\r\n\r\n", 403},
      {"GET /%zz HTTP/1.1\r\nHost: " + Host() + "\r\n\r\n", 400},
      {"GET http://x/ HTTP/1.1\r\nHost: " + Host() + "\r\n\r\n", 400},
      {"nonsense\r\n\r\n", 400},
      {"GET / HTTP/1.1\r\nHost: " + Host() + "\r\nX: " + std::string(20000, 'x') + "\r\n\r\n", 431},
      {"GET /" + std::string(20000, 'x') + " HTTP/1.1\r\nHost: " + Host() + "\r\n\r\n", 431},
      {std::string(100000, 'x'), 431}};
  for (const auto& [request, status] : requests) {
    RawClient client(port());
    client.Say(request);
    const std::string answer = client.HearAll();
    EXPECT_EQ(StatusOf(answer), status) << request.substr(0, 60);
    EXPECT_NE(BodyOf(answer).find("\"error\""), std::string::npos) << request.substr(0, 60);
  }
  EXPECT_EQ(num_handled_, 0);
  ExpectAlive();
}

TEST_F(WebServerTest, AHandlerThatForgetsToAnswerIsToldOf) {
  Start();
  EXPECT_EQ(StatusOf(Ask("GET /never")), 500);
}

TEST_F(WebServerTest, AnAnswerMayComeAfterTheServer) {
  Start();
  {
    RawClient client(port());
    client.Say("GET /kept HTTP/1.1\r\nHost: " + Host() + "\r\n\r\n");
    ASSERT_TRUE(WaitFor([this] { return num_handled_ == 1; }));
  }
  server_.reset();
  kept_(JsonResponse("{}"));
}

TEST_F(WebServerTest, ATakenPortIsAnErrorThatSaysSo) {
  Start();
  WebServerOptions same = options_;
  same.port = port();
  const auto second = WebServer::Start(same, log_, [](const HttpRequest&, const Respond&) {});
  ASSERT_FALSE(second.ok());
  EXPECT_EQ(second.code(), StatusCode::kAlreadyExists);
  EXPECT_NE(second.error().find("--port"), std::string::npos);
}

TEST_F(WebServerTest, AThousandIdleSocketsKeepNobodyOut) {
  rlimit limit{};
  getrlimit(RLIMIT_NOFILE, &limit);
  limit.rlim_cur = std::min<rlim_t>(limit.rlim_max, 4096);
  setrlimit(RLIMIT_NOFILE, &limit);
  ASSERT_GE(limit.rlim_cur, 3000u);
  Start();
  std::vector<std::unique_ptr<RawClient>> idle;
  for (int i = 0; i < 1000; ++i) {
    idle.push_back(std::make_unique<RawClient>(port()));
    if (i % 2 == 0) idle.back()->Say("GET / HT");  // and says no more
  }
  ExpectAlive();
  EXPECT_LE(server_->num_connections(), options_.max_connections);
  idle.clear();
  EXPECT_TRUE(WaitFor([this] { return server_->num_connections() == 0; }));
}

TEST_F(WebServerTest, ConnectionsThatWorkAreNotThrownOut) {
  options_.max_connections = 2;
  Start();
  RawClient one(port()), two(port());
  for (RawClient* client : {&one, &two}) {
    client->Say("GET /large HTTP/1.1\r\nHost: " + Host() + "\r\nConnection: close\r\n\r\n");
  }
  ASSERT_TRUE(WaitFor([this] { return num_handled_ == 2; }));
  EXPECT_EQ(StatusOf(Ask("GET /alive")), 503) << "both are being answered";
  EXPECT_GT(one.HearAll().size(), size_t{50} << 20);
  EXPECT_GT(two.HearAll().size(), size_t{50} << 20);
  ExpectAlive();
}

TEST_F(WebServerTest, WhoTakesNoByteIsClosed) {
  options_.bounds.idle_s = 0.3;
  Start();
  RawClient client(port());
  client.Say("GET /large HTTP/1.1\r\nHost: " + Host() + "\r\n\r\n");
  ASSERT_TRUE(WaitFor([this] { return num_handled_ == 1; }));
  EXPECT_TRUE(WaitFor([this] { return server_->num_connections() == 0; }));
}

// A byte at a time is no progress: the time is that of all of it.
TEST_F(WebServerTest, AHeaderOrABodyThatComesByteByByteIsNotWaitedFor) {
  options_.bounds.idle_s = 0.5;
  options_.bounds.body_s = 0.5;
  Start();
  EXPECT_TRUE(HangsUpOn(port(), "GET / HTTP/1.1\r\nX: ", "x"));
  EXPECT_TRUE(HangsUpOn(port(), "GET / HTTP/1.1\r\n", "X: x\r\n"));
  EXPECT_TRUE(HangsUpOn(
      port(), "POST /api/enter HTTP/1.1\r\nHost: " + Host() + "\r\nContent-Length: 60000\r\n\r\n{",
      " "));
  EXPECT_EQ(num_handled_, 0);
  ExpectAlive();
}

TEST_F(WebServerTest, AFrameThatDoesNotEndKeepsNoWebSocket) {
  options_.bounds.idle_s = 0.5;
  Start();
  RawClient page(port());
  page.Say("GET /ws HTTP/1.1\r\nHost: " + Host() +
           "\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
           "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n");
  EXPECT_EQ(StatusOf(page.HearHeader()), 101);
  ASSERT_TRUE(WaitFor([this] { return server_->num_viewers() == 1; }));
  // Text of 126 bytes and more, whose length, mask and content never come; nor does a pong.
  page.Say("\x81\xfe");
  EXPECT_TRUE(WaitFor([this] { return server_->num_connections() == 0; }));
}

// A page's WebSocket, read when it is asked to.
class Page {
 public:
  explicit Page(int port, const std::string& origin = "", const std::string& cookie = "")
      : stream_(context_) {
    beast::get_lowest_layer(stream_).connect(
        tcp::endpoint(asio::ip::make_address("127.0.0.1"), static_cast<uint16_t>(port)), error_);
    stream_.set_option(
        websocket::stream_base::decorator([origin, cookie](websocket::request_type& request) {
          if (!origin.empty()) request.set(http::field::origin, origin);
          if (!cookie.empty()) request.set(http::field::cookie, cookie);
        }));
    stream_.handshake("127.0.0.1:" + std::to_string(port), "/ws", error_);
  }

  bool ok() const { return !error_; }
  json Hear() {
    beast::flat_buffer buffer;
    stream_.read(buffer, error_);
    return error_ ? json() : json::parse(beast::buffers_to_string(buffer.data()));
  }
  void Say(const std::string& text) { stream_.write(asio::buffer(text), error_); }
  // What the server said when it closed the WebSocket.
  websocket::close_reason HearEnd() {
    while (ok()) Hear();
    return stream_.reason();
  }

 private:
  asio::io_context context_;
  websocket::stream<tcp::socket> stream_;
  ErrorCode error_;
};

std::string Event(int64_t seq, size_t bytes = 0) {
  return json({{"seq", seq}, {"pad", std::string(bytes, 'x')}}).dump();
}

TEST_F(WebServerTest, APageIsGreetedAndToldOfEventsInOrder) {
  options_.session_id = "0123";
  log_.Append(1, Event(1));
  Start();
  Page page(port());
  ASSERT_TRUE(page.ok());
  EXPECT_EQ(page.Hear(), (json{{"type", "hello"}, {"session_id", "0123"}, {"head", 1}}));
  int64_t next = 2;
  for (int64_t seq = 2; seq <= 200; ++seq) {
    log_.Append(seq, seq % 5 == 0 ? "" : Event(seq));
    server_->NoteEvents();
  }
  while (next <= 199) {
    const json message = page.Hear();
    ASSERT_TRUE(page.ok());
    ASSERT_EQ(message["type"], "events");
    for (const json& event : message["events"]) {
      if (next % 5 == 0) ++next;
      EXPECT_EQ(event["seq"], next++);
    }
  }
}

TEST_F(WebServerTest, WhatIsLatestIsToldToWhoComesLater) {
  Start();
  server_->TellLatest("status", json({{"type", "status"}, {"n", 1}}).dump());
  server_->TellLatest("status", json({{"type", "status"}, {"n", 2}}).dump());
  server_->TellLatest("shape/3", json({{"type", "shape"}}).dump());
  Page page(port());
  EXPECT_EQ(page.Hear()["type"], "hello");
  EXPECT_EQ(page.Hear()["type"], "shape");
  EXPECT_EQ(page.Hear()["n"], 2);
  server_->TellLatest("status", json({{"type", "status"}, {"n", 3}}).dump());
  EXPECT_EQ(page.Hear()["n"], 3);
}

TEST_F(WebServerTest, ForeignPagesGetNoWebSocket) {
  Start();
  EXPECT_TRUE(Page(port(), "http://" + Host()).ok());
  EXPECT_FALSE(Page(port(), "http://evil.example").ok());
}

// A server with a door, in the clear.
class WebDoorTest : public WebServerTest {
 protected:
  WebDoorTest() {
    const auto access = OpenSessionKeys(keys_, "0123", Role::kWeb, "web");
    EXPECT_TRUE(access.ok()) << access.error();
    PassAccess& visitors = options_.access.emplace();
    visitors.host = "127.0.0.1";
    visitors.doors.push_back({"127.0.0.1", 0, std::nullopt});
    visitors.trust = access->trust;
    visitors.is_revoked = [this](const std::string& name) {
      return name == "anna" && is_anna_revoked_;
    };
  }

  std::string CookieOf(Role role, const std::string& name, int64_t expires_s = 0) const {
    return "skein_0123=" + *IssueWebPass(keys_, "0123", {role, name, expires_s});
  }
  int door() const { return server_->door_ports().front(); }
  std::string AskDoor(const std::string& first_line, const std::string& cookie) {
    RawClient client(door());
    client.Say(first_line + " HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\nCookie: " +
               cookie + "\r\n\r\n");
    return client.HearAll();
  }

  const std::string keys_ = (folder_ / "keys").string();
  std::atomic<bool> is_anna_revoked_{false};
};

TEST_F(WebDoorTest, AWebSocketEndsWithItsPass) {
  Start();
  constexpr int64_t kLifeS = 2;
  Page anna(door(), "", CookieOf(Role::kViewer, "anna"));
  Page vera(door(), "", CookieOf(Role::kViewer, "vera"));
  Page late(door(), "", CookieOf(Role::kViewer, "late", NowUs() / 1'000'000 + kLifeS)), own(port());
  for (Page* page : {&anna, &vera, &late, &own}) ASSERT_EQ(page->Hear()["type"], "hello");
  EXPECT_FALSE(Page(door()).ok()) << "without a pass";

  is_anna_revoked_ = true;
  websocket::close_reason end = anna.HearEnd();
  EXPECT_EQ(end.code, websocket::close_code::policy_error);
  EXPECT_EQ(end.reason, "this invitation was revoked");
  end = late.HearEnd();
  EXPECT_EQ(end.code, websocket::close_code::policy_error);
  EXPECT_NE(std::string(end.reason.c_str()).find("expired"), std::string::npos);

  EXPECT_TRUE(WaitFor([this] { return server_->num_viewers() == 2; }));
  log_.Append(1, Event(1));
  server_->NoteEvents();
  EXPECT_EQ(vera.Hear()["type"], "events") << "another's pass";
  EXPECT_EQ(own.Hear()["type"], "events") << "none is needed on the session's own host";
}

TEST_F(WebDoorTest, AnOperatorsProgramReadsTheMetrics) {
  Start();
  const auto ask = [this](Role role) {
    RawClient client(door());
    client.Say("GET /metrics HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n" +
               ("Authorization: Bearer " + *IssueWebPass(keys_, "0123", {role, "prometheus", 0})) +
               "\r\n\r\n");
    return StatusOf(client.HearAll());
  };
  EXPECT_EQ(ask(Role::kOperator), 200);
  EXPECT_EQ(ask(Role::kViewer), 403);
  EXPECT_EQ(ask(Role::kAgent), 403);
  EXPECT_EQ(StatusOf(AskDoor("GET /metrics", "")), 401);
  EXPECT_EQ(StatusOf(AskDoor("GET /metrics", CookieOf(Role::kOperator, "olga"))), 200);
  EXPECT_EQ(StatusOf(Ask("GET /metrics")), 200) << "by the own port";
}

// The door is for others: with a pass the own port does what the door does.
TEST_F(WebDoorTest, AnOperatorFinishesByTheOwnPort) {
  options_.access->doors.clear();
  Start();
  const std::string pass = *IssueWebPass(keys_, "0123", {Role::kOperator, "anna", 0});
  const std::string body = json({{"pass", pass}}).dump();
  const std::string entered =
      Ask("POST /api/enter", "Content-Length: " + std::to_string(body.size()) + "\r\n\r\n" + body);
  EXPECT_EQ(StatusOf(entered), 200) << entered;
  EXPECT_NE(entered.find("Set-Cookie: skein_0123=" + pass), std::string::npos) << entered;

  const auto finish = [this](const std::string& headers) {
    return StatusOf(Ask("POST /api/finish", headers + "Content-Length: 0\r\n"));
  };
  const std::string cookie = "Cookie: skein_0123=" + pass + "\r\n";
  EXPECT_EQ(finish(""), 403) << "a viewer";
  EXPECT_EQ(finish(cookie), 200);
  EXPECT_EQ(finish(cookie + "Origin: http://" + Host() + "\r\n"), 200);
  EXPECT_EQ(finish(cookie + "Origin: http://evil.example\r\n"), 403);
  EXPECT_EQ(finish(cookie + "Origin: http://127.0.0.1:1\r\n"), 403);
  is_anna_revoked_ = true;
  EXPECT_EQ(finish(cookie), 403) << "revoked";
  EXPECT_EQ(StatusOf(Ask("GET /api/events", cookie)), 200) << "a viewer again";
}

// Neither a page that does not answer the goodbye nor a download keeps its TCP connection.
TEST_F(WebDoorTest, RevokingClosesConnectionsWithinTwoSeconds) {
  Start();
  const std::string cookie = CookieOf(Role::kViewer, "anna");
  const std::string head = " HTTP/1.1\r\nHost: 127.0.0.1\r\nCookie: " + cookie + "\r\n";
  RawClient page(door()), download(door());
  page.Say("GET /ws" + head +
           "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
           "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n");
  download.Say("GET /large" + head + "\r\n");
  ASSERT_TRUE(WaitFor([this] { return server_->num_viewers() == 1 && num_handled_ == 1; }));
  ASSERT_EQ(server_->num_connections(), 2);
  is_anna_revoked_ = true;
  const double revoked_s = MonotonicS();
  EXPECT_TRUE(WaitFor([this] { return server_->num_connections() == 0; }));
  EXPECT_LT(MonotonicS() - revoked_s, 2);
}

TEST_F(WebDoorTest, AViewersSocketsKeepOutNeitherTheOwnPortNorOperatorsNorOthers) {
  options_.max_connections = 46;  // 16 for the own port, 16 for operators
  Start();
  const std::string greedy = CookieOf(Role::kViewer, "greedy");
  std::vector<std::unique_ptr<Page>> pages;
  for (int i = 0; i < 25; ++i) pages.push_back(std::make_unique<Page>(door(), "", greedy));
  EXPECT_LE(server_->num_viewers(), 14);
  EXPECT_GE(server_->num_viewers(), 10);
  Page other(door(), "", CookieOf(Role::kViewer, "other"));
  EXPECT_EQ(other.Hear()["type"], "hello");
  Page chief(door(), "", CookieOf(Role::kOperator, "chief"));
  EXPECT_EQ(chief.Hear()["type"], "hello");
  Page own(port());
  EXPECT_EQ(own.Hear()["type"], "hello");
  for (int i = 0; i < 25; ++i) pages.push_back(std::make_unique<Page>(door(), "", greedy));
  log_.Append(1, Event(1));
  server_->NoteEvents();
  for (Page* page : {&other, &chief, &own}) {
    EXPECT_EQ(page->Hear()["type"], "events") << "who has few places keeps them";
  }
  ExpectAlive();
}

// They have no pass, ask for a file of the page, and take it byte by byte.
TEST_F(WebDoorTest, AnswersThatNobodyTakesKeepOutNobody) {
  options_.max_connections = 46;  // 16 for the own port, 16 for operators
  MakeLargeFile();
  Start();
  const auto ask = [this] {
    auto client = std::make_unique<RawClient>(door());
    client->Say("GET /file HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n");
    EXPECT_EQ(StatusOf(client->HearHeader()), 200);
    return client;
  };
  std::vector<std::unique_ptr<RawClient>> slow;
  for (int i = 0; i < 14; ++i) slow.push_back(ask());
  EXPECT_EQ(server_->num_connections(), 14);
  EXPECT_EQ(StatusOf(AskDoor("GET /api/session", CookieOf(Role::kViewer, "vera"))), 200);
  Page anna(door(), "", CookieOf(Role::kViewer, "anna"));
  EXPECT_EQ(anna.Hear()["type"], "hello");
  for (int i = 0; i < 14; ++i) slow.push_back(ask());
  log_.Append(1, Event(1));
  server_->NoteEvents();
  EXPECT_EQ(anna.Hear()["type"], "events") << "who shows a pass keeps the place";
  ExpectAlive();
}

// Throws at a step of an upload: in a job, or on the server's thread for "make" and "call".
class ThrowingSink : public BodySink {
 public:
  ThrowingSink(JobPool& jobs, std::string step) : jobs_(jobs), step_(std::move(step)) {}
  void Begin(Next next) override {
    if (step_ == "call") throw std::bad_alloc();
    GoOn("begin", std::move(next));
  }
  void Take(Bytes, Next next) override { GoOn("take", std::move(next)); }
  void End(Next next) override { GoOn("end", std::move(next)); }

 private:
  void GoOn(const std::string& step, Next next) {
    jobs_.Run([throws = step == step_, next = std::move(next)] {
      if (throws) throw std::bad_alloc();
      next(std::nullopt);
    });
  }

  JobPool& jobs_;
  const std::string step_;
};

TEST_F(WebDoorTest, AnswersAnUploadOnWhichAnExceptionComesAndGoesOn) {
  JobPool jobs(1);
  uploads_.make_sink = [&](const HttpRequest& request) -> std::shared_ptr<BodySink> {
    const std::string step = request.path.substr(request.path.rfind('/') + 1);
    if (step == "make") throw std::bad_alloc();
    return std::make_shared<ThrowingSink>(jobs, step);
  };
  Start();
  for (const std::string step : {"make", "call", "begin", "take", "end"}) {
    RawClient client(door());
    client.Say("PATCH /api/uploads/" + step + " HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close" +
               "\r\nContent-Length: 3\r\nCookie: " + CookieOf(Role::kAgent, "anna") +
               "\r\n\r\nabc");
    EXPECT_EQ(StatusOf(client.HearAll()), 500) << step;
  }
  ExpectAlive();
  server_.reset();
}

TEST_F(WebDoorTest, AnAddressPushesOutItsOwnAnswersThatNobodyTakes) {
  options_.max_connections = 100;
  options_.bounds.max_of_address = 3;
  MakeLargeFile();
  Start();
  std::vector<std::unique_ptr<RawClient>> slow;
  for (int i = 0; i < 5; ++i) {
    slow.push_back(std::make_unique<RawClient>(door()));
    slow.back()->Say("GET /file HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n");
    EXPECT_EQ(StatusOf(slow.back()->HearHeader()), 200) << i;
  }
  EXPECT_LE(server_->num_connections(), 3);
}

TEST_F(WebDoorTest, AHandshakeThatDoesNotEndIsNotWaitedFor) {
  const auto certificate = OpenWebCertificate(keys_, {"127.0.0.1"}, NowUs() / 1'000'000);
  ASSERT_TRUE(certificate.ok()) << certificate.error();
  options_.access->doors.front().certificate = *certificate;
  options_.bounds.handshake_s = 0.5;
  Start();
  EXPECT_TRUE(HangsUpOn(door(), "", ""));
  // A record of 16 KiB, byte by byte.
  EXPECT_TRUE(HangsUpOn(door(), std::string("\x16\x03\x01\x40\x00", 5), "\x01"));
  ExpectAlive();
}

// Early data (RFC 8446, 8) can be recorded and sent again.
TEST_F(WebDoorTest, TakesNoRequestBeforeTheHandshakeIsWhole) {
  const auto certificate = OpenWebCertificate(keys_, {"127.0.0.1"}, NowUs() / 1'000'000);
  ASSERT_TRUE(certificate.ok()) << certificate.error();
  options_.access->doors.front().certificate = *certificate;
  Start();
  asio::io_context context;
  asio::ssl::context tls(asio::ssl::context::tls_client);
  asio::ssl::stream<tcp::socket> stream(context, tls);
  stream.next_layer().connect({asio::ip::make_address("127.0.0.1"), static_cast<uint16_t>(door())});
  stream.handshake(asio::ssl::stream_base::client);
  const std::string request = "GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n\r\n";
  asio::write(stream, asio::buffer(request));
  std::string heard;
  ErrorCode error;
  asio::read(stream, asio::dynamic_buffer(heard), error);
  EXPECT_EQ(StatusOf(heard), 200);
  ASSERT_EQ(SSL_version(stream.native_handle()), TLS1_3_VERSION);
  // The ticket came with the answer.
  const std::unique_ptr<SSL_SESSION, decltype(&SSL_SESSION_free)> session(
      SSL_get1_session(stream.native_handle()), SSL_SESSION_free);
  EXPECT_TRUE(SSL_SESSION_has_ticket(session.get()));
  EXPECT_EQ(SSL_SESSION_get_max_early_data(session.get()), 0u);
}

TEST_F(WebDoorTest, APassAndAnAddressHaveTheirShare) {
  options_.max_connections = 100;
  options_.bounds.max_of_pass = 3;
  options_.bounds.max_of_address = 6;
  Start();
  const std::string anna = CookieOf(Role::kViewer, "anna"), vera = CookieOf(Role::kViewer, "vera");
  std::vector<std::unique_ptr<Page>> pages;
  for (int i = 0; i < 3; ++i) pages.push_back(std::make_unique<Page>(door(), "", anna));
  for (const auto& page : pages) EXPECT_EQ(page->Hear()["type"], "hello");
  EXPECT_FALSE(Page(door(), "", anna).ok());
  EXPECT_EQ(StatusOf(AskDoor("GET /api/session", anna)), 503);
  EXPECT_EQ(StatusOf(AskDoor("GET /api/session", vera)), 200);
  for (int i = 0; i < 3; ++i) pages.push_back(std::make_unique<Page>(door(), "", vera));
  EXPECT_EQ(StatusOf(AskDoor("GET /api/session", CookieOf(Role::kViewer, "third"))), 503);
  ExpectAlive();
}

// A page that reads nothing gets the head in place of the events that do not fit, and holds up
// nobody.
TEST_F(WebServerTest, ASlowPageIsToldTheHead) {
  options_.bounds.gather_s = 0;
  Start();
  Page slow(port()), quick(port());
  EXPECT_EQ(quick.Hear()["type"], "hello");
  constexpr int64_t kEvents = 400;
  constexpr size_t kEventBytes = 100'000;  // 40 MB: far more than the kernel's buffers hold
  int64_t last = 0;
  for (int64_t seq = 1; seq <= kEvents; ++seq) {
    log_.Append(seq, Event(seq, kEventBytes));
    server_->NoteEvents();
    while (last < seq) {
      const json message = quick.Hear();
      ASSERT_TRUE(quick.ok());
      ASSERT_EQ(message["type"], "events") << "a page that reads gets all";
      for (const json& event : message["events"]) EXPECT_EQ(event["seq"], ++last);
    }
  }
  EXPECT_EQ(slow.Hear()["type"], "hello");
  int64_t seen = 0;
  json message = slow.Hear();
  while (slow.ok() && message["type"] == "events") {
    for (const json& event : message["events"]) EXPECT_EQ(event["seq"], ++seen);
    message = slow.Hear();
  }
  ASSERT_TRUE(slow.ok());
  EXPECT_EQ(message, (json{{"type", "head"}, {"head", kEvents}}));
  EXPECT_LT(seen, kEvents);
  log_.Append(kEvents + 1, Event(kEvents + 1));
  server_->NoteEvents();
  message = slow.Hear();
  ASSERT_EQ(message["type"], "events") << "it is in the flow again";
  EXPECT_EQ(message["events"][0]["seq"], kEvents + 1);
}

TEST_F(WebServerTest, APageThatTakesNothingIsClosed) {
  options_.bounds.stalled_s = 0.3;
  Start();
  Page page(port());
  ASSERT_TRUE(WaitFor([this] { return server_->num_viewers() == 1; }));
  server_->TellLatest("large", std::string(size_t{32} << 20, 'x'));
  EXPECT_TRUE(WaitFor([this] { return server_->num_viewers() == 0; }));
}

TEST_F(WebServerTest, APageThatFloodsIsClosed) {
  Start();
  Page page(port());
  for (int i = 0; i < 100 && page.ok(); ++i) page.Say("x");
  EXPECT_TRUE(WaitFor([this] { return server_->num_viewers() == 0; }));
  Page talker(port());
  talker.Say(std::string(5000, 'x'));
  EXPECT_TRUE(WaitFor([this] { return server_->num_viewers() == 0; })) << "one message too large";
  ExpectAlive();
}

TEST_F(WebServerTest, ManyWhoAskAtOnceAreAllAnswered) {
  Start();
  std::atomic<int> num_good{0};
  std::vector<std::thread> threads;
  for (int i = 0; i < 8; ++i) {
    threads.emplace_back([this, &num_good] {
      for (int k = 0; k < 200; ++k) num_good += StatusOf(Ask("GET /x")) == 200 ? 1 : 0;
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(num_good, 1600);
}

}  // namespace skein::web_server_test
