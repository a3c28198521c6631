#include "http/http_connection.h"

#include <fcntl.h>

#include <algorithm>
#include <type_traits>
#include <utility>

#include "core/attempt.h"
#include "core/clock.h"
#include "core/file_below.h"
#include "core/log.h"
#include "core/utf8.h"
#include "http/access.h"
#include "transport/loopback.h"

namespace skein {
namespace {

constexpr char kPolicy[] =
    "default-src 'self'; img-src 'self' blob: data:; style-src 'self'; script-src 'self'; "
    "object-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

// The page asks the phone for these itself, and no frame of another site may.
constexpr char kPermissions[] =
    "camera=(self), geolocation=(self), gyroscope=(self), magnetometer=(self), "
    "accelerometer=(self), screen-wake-lock=(self), microphone=()";

constexpr uint32_t kMaxHeaderBytes = 8 << 10;  // of a request
constexpr uint64_t kMaxBodyBytes = 64 << 10;   // of a POST
constexpr size_t kMaxPartBytes = 256 << 10;    // of an upload that are in memory at a time

constexpr double kUploadIdleS = 30;  // an upload of which nothing comes for so long is closed
constexpr double kPaceWindowS = 60;
constexpr double kMinUploadBytesPerS = 1 << 10;  // a slower upload is closed after kPaceWindowS

// Of a file, read at a time.
constexpr size_t kFilePartBytes = 256 << 10;

constexpr double kLingerS = 2;
constexpr size_t kMaxLingerBytes = 1 << 20;

WebStream StreamOf(tcp::socket socket, const Door& door) {
  if (door.tls != nullptr) return WebStream(std::move(socket), *door.tls);
  return WebStream(std::move(socket));
}

std::string LocalAddressOf(const tcp::socket& socket) {
  ErrorCode error;
  return socket.local_endpoint(error).address().to_string();
}

std::optional<std::string> Header(const UpgradeRequest& request, http::field field) {
  const auto found = request.find(field);
  if (found == request.end()) return std::nullopt;
  return std::string(found->value());
}

// A message with what it is made of.
template <class Body>
struct Outgoing {
  http::response<Body> message;
  std::optional<http::response_serializer<Body>> serializer;  // once the message is complete
  HttpResponse content;
};

}  // namespace

// A file as an answer. Its methods may wait for the disk: they are for jobs, one at a time.
struct HttpConnection::OutgoingFile {
  // Opens it and reads the first part. False where that fails.
  bool Open() {
    Result<FileDescriptor> opened = OpenFileBelow(content.file_root, content.file, O_RDONLY);
    if (!opened.ok()) {
      error = boost::system::errc::make_error_code(boost::system::errc::no_such_file_or_directory);
      return false;
    }
    file.native_handle(opened->Release());
    left_bytes = size_bytes = file.size(error);
    return !error && Read();
  }
  bool Read() {
    part.resize(static_cast<size_t>(std::min<uint64_t>(left_bytes, kFilePartBytes)));
    if (part.empty()) return true;
    part.resize(file.read(part.data(), part.size(), error));
    if (!error && part.empty()) error = http::error::partial_message;  // it has shrunk
    left_bytes -= part.size();
    return !error;
  }

  http::response<http::buffer_body> message;
  std::optional<http::response_serializer<http::buffer_body>> serializer;
  HttpResponse content;
  beast::file_posix file;
  ErrorCode error;
  uint64_t size_bytes = 0, left_bytes = 0;
  Bytes part;
};

HttpConnection::HttpConnection(ConnectionHost& host, int64_t id, tcp::socket socket,
                               const Door& door)
    : host_(host),
      id_(id),
      door_(door),
      local_address_(LocalAddressOf(socket)),
      stream_(StreamOf(std::move(socket), door)),
      buffer_(size_t{kMaxHeaderBytes} * 2) {}

void HttpConnection::Start() {
  if (!stream_.is_encrypted()) return ReadRequest();
  waiting_since_s_ = MonotonicS();
  stream_.lowest().expires_after(Milliseconds(host_.options().bounds.handshake_s));
  stream_.async_handshake([self = shared_from_this()](ErrorCode error) {
    error ? self->Close() : self->ReadRequest();
  });
}

void HttpConnection::ReadRequest() {
  waiting_since_s_ = MonotonicS();
  parser_.emplace();
  parser_->body_limit(UINT64_MAX);  // bodies have limits of their own; Boost 1.74 takes none for 0
  parser_->header_limit(kMaxHeaderBytes);
  stream_.lowest().expires_after(Milliseconds(host_.options().bounds.idle_s));
  http::async_read_header(stream_, buffer_, *parser_,
                          [self = shared_from_this()](ErrorCode error, size_t) {
                            error ? self->OnBadRequest(error) : self->OnRequest();
                          });
}

void HttpConnection::OnBadRequest(ErrorCode error) {
  if (error == http::error::header_limit || error == http::error::buffer_overflow) {
    return AnswerAndClose(431, "the request's header is too large: at most " +
                                   std::to_string(kMaxHeaderBytes) + " bytes");
  }
  const bool malformed = error.category() == make_error_code(http::error::bad_method).category() &&
                         error != http::error::end_of_stream &&
                         error != http::error::partial_message;
  malformed ? AnswerAndClose(400, "not an HTTP request: " + error.message()) : Close();
}

void HttpConnection::OnRequest() {
  waiting_since_s_.reset();
  if (closed_) return;
  const UpgradeRequest& request = parser_->get();
  is_head_ = request.method() == http::verb::head;
  keep_alive_ = request.keep_alive();
  range_ = Header(request, http::field::range).value_or("");
  std::optional<HttpRequest> parsed;
  AccessDecision access;
  const Status judged = Attempt([&] {
    parsed = ParsedRequest(request);
    if (parsed) access = AccessOf(*parsed, request);
  });
  if (!judged.ok()) return AnswerFailed(judged);
  if (!parsed) return AnswerAndClose(400, "the request's target is malformed");
  if (!access.allowed()) {
    if (parsed->body_bytes > 0 || parser_->chunked()) keep_alive_ = false;
    return keep_alive_ ? Answer(HttpError(access.status, access.reason))
                       : AnswerAndClose(access.status, access.reason);
  }
  if (const Status place = host_.NoteVisitor(id_, parsed->visitor); !place.ok()) {
    return AnswerAndClose(503, place.error());
  }
  const bool takes_body = parsed->method == "PATCH" || parsed->method == "POST";
  if (!takes_body && (parsed->body_bytes > 0 || parser_->chunked())) {
    return AnswerAndClose(413, "a request has no body here");
  }
  if (parser_->chunked()) return AnswerAndClose(411, "say the body's size: Content-Length");
  if (parsed->method == "PATCH") return BeginUpload(*parsed);
  if (parsed->method == "POST") return ReadSmallBody(*parsed);
  if (!websocket::is_upgrade(request)) return HandOver(*parsed);
  if (parsed->path != "/ws") return AnswerAndClose(404, "the WebSocket is at /ws");
  closed_ = true;  // what goes on is no longer this
  host_.Upgrade(id_, std::move(stream_), parser_->release());
}

AccessDecision HttpConnection::AccessOf(const HttpRequest& parsed,
                                        const UpgradeRequest& request) const {
  AccessRequest asked;
  asked.method = parsed.method;
  asked.path = parsed.path;
  asked.host = Header(request, http::field::host);
  asked.origin = Header(request, http::field::origin);
  asked.local_address = local_address_;
  asked.public_host = door_.is_public ? host_.options().access->host : "";
  asked.is_websocket = websocket::is_upgrade(request);
  asked.is_encrypted = stream_.is_encrypted();
  asked.visitor = parsed.visitor;
  asked.agent_of = [this](int64_t image_id) { return host_.AgentOfPhoto(image_id); };
  return DecideAccess(asked);
}

std::optional<HttpRequest> HttpConnection::ParsedRequest(const UpgradeRequest& request) const {
  std::optional<HttpRequest> parsed =
      ParseTarget({request.target().data(), request.target().size()});
  if (!parsed) return std::nullopt;
  parsed->method = std::string(request.method_string());
  parsed->body_bytes = parser_->content_length().value_or(0);
  parsed->is_public = door_.is_public;
  parsed->is_encrypted = stream_.is_encrypted();
  const std::string encodings = Header(request, http::field::accept_encoding).value_or("");
  parsed->takes_gzip = encodings.find("gzip") != std::string::npos;
  for (const auto& field : request) {
    const std::string name = LowerCase(std::string(field.name_string()));
    if (name.compare(0, 7, "upload-") == 0) parsed->fields[name] = std::string(field.value());
  }
  // In the clear a pass goes no further than this host, but for the port that was opened for it.
  if (door_.is_public || IsLoopbackAddress(local_address_)) {
    parsed->visitor = host_.FindVisitor(Header(request, http::field::cookie).value_or(""),
                                        Header(request, http::field::authorization).value_or(""));
  }
  parsed->visitor.is_local = !door_.is_public;
  return parsed;
}

// Until it has come, another connection may take this one's place.
void HttpConnection::ReadSmallBody(HttpRequest request) {
  if (request.body_bytes > kMaxBodyBytes) {
    return AnswerAndClose(
        413, "the body is too large: at most " + std::to_string(kMaxBodyBytes) + " bytes");
  }
  waiting_since_s_ = MonotonicS();
  const auto parser =
      std::make_shared<http::request_parser<http::string_body>>(std::move(*parser_));
  parser_.reset();
  parser->body_limit(kMaxBodyBytes);
  stream_.lowest().expires_after(Milliseconds(host_.options().bounds.body_s));
  http::async_read(stream_, buffer_, *parser,
                   [self = shared_from_this(), parser, request = std::move(request)](
                       ErrorCode error, size_t) mutable {
                     if (error) return self->Close();
                     self->waiting_since_s_.reset();
                     request.body = std::move(parser->get().body());
                     self->HandOver(request);
                   });
}

void HttpConnection::HandOver(const HttpRequest& request) {
  due_since_s_ = MonotonicS();
  host_.Handle(id_, request);
}

void HttpConnection::BeginUpload(const HttpRequest& request) {
  const Status made = Attempt([&] { sink_ = host_.MakeSink(request); });
  if (!made.ok()) return AnswerFailed(made);
  if (sink_ == nullptr) return AnswerAndClose(404, "nothing is uploaded there");
  const bool is_waited_for = Header(parser_->get(), http::field::expect).has_value();
  upload_parser_.emplace(std::move(*parser_));
  parser_.reset();
  part_.resize(kMaxPartBytes);
  part_bytes_ = 0;
  pace_since_s_ = MonotonicS();
  pace_bytes_ = 0;
  sink_->Begin(host_.OnServer(
      id_, [is_waited_for](HttpConnection& self, std::optional<HttpResponse> answer) {
        if (answer) {
          self.sink_.reset();
          self.keep_alive_ = false;
          return self.Answer(std::move(*answer));
        }
        if (!is_waited_for || self.upload_parser_->is_done()) return self.ReadUpload();
        // curl and others wait for a word before they send much.
        static const std::string kGoOn = "HTTP/1.1 100 Continue\r\n\r\n";
        asio::async_write(self.stream_, asio::buffer(kGoOn),
                          [kept = self.shared_from_this()](ErrorCode error, size_t) {
                            error ? kept->Close() : kept->ReadUpload();
                          });
      }));
}

void HttpConnection::ReadUpload() {
  if (closed_) return;
  if (upload_parser_->is_done()) return GivePart(false);
  auto& body = upload_parser_->get().body();
  body.data = part_.data() + part_bytes_;
  body.size = part_.size() - part_bytes_;
  body.more = false;
  stream_.lowest().expires_after(Milliseconds(kUploadIdleS));
  http::async_read_some(
      stream_, buffer_, *upload_parser_,
      [self = shared_from_this()](ErrorCode error, size_t) { self->OnUploadRead(error); });
}

void HttpConnection::OnUploadRead(ErrorCode error) {
  if (closed_) return;
  if (error == http::error::need_buffer) error = {};
  const size_t filled = part_.size() - upload_parser_->get().body().size;
  pace_bytes_ += filled - part_bytes_;
  part_bytes_ = filled;
  // What came before the connection was lost counts.
  if (error) return GivePart(true);
  if (IsTooSlow()) {
    LogWarn("an upload was too slow and was closed; it goes on where it stopped");
    return GivePart(true);
  }
  if (part_bytes_ == part_.size() || upload_parser_->is_done()) return GivePart(false);
  ReadUpload();
}

// One that never ends would keep its place for ever.
bool HttpConnection::IsTooSlow() {
  const double now_s = MonotonicS();
  if (now_s - pace_since_s_ < kPaceWindowS) return false;
  const bool is_slow =
      static_cast<double>(pace_bytes_) < kMinUploadBytesPerS * (now_s - pace_since_s_);
  pace_since_s_ = now_s;
  pace_bytes_ = 0;
  return is_slow;
}

void HttpConnection::GivePart(bool and_close) {
  if (part_bytes_ == 0) return and_close ? Close() : EndUpload();
  stream_.lowest().expires_never();
  Bytes part(part_.begin(), part_.begin() + static_cast<std::ptrdiff_t>(part_bytes_));
  part_bytes_ = 0;
  sink_->Take(std::move(part), host_.OnServer(id_, [and_close](HttpConnection& self,
                                                               std::optional<HttpResponse> answer) {
    if (and_close) return self.Close();
    if (!answer) return self.ReadUpload();
    self.sink_.reset();
    self.keep_alive_ = false;
    self.Answer(std::move(*answer));
  }));
}

void HttpConnection::EndUpload() {
  sink_->End(host_.OnServer(id_, [](HttpConnection& self, std::optional<HttpResponse> answer) {
    self.sink_.reset();
    self.part_ = Bytes();
    self.upload_parser_.reset();
    self.Answer(answer ? std::move(*answer) : HttpError(500, "the upload was not answered"));
  }));
}

void HttpConnection::AnswerAndClose(int status, const std::string& line) {
  waiting_since_s_.reset();
  keep_alive_ = false;
  range_.clear();
  Answer(HttpError(status, line));
}

void HttpConnection::AnswerFailed(const Status& status) {
  LogError("a request failed: {}", status.error());
  AnswerAndClose(500, "the request failed; the log says why");
}

void HttpConnection::Refuse() {
  if (stream_.is_encrypted()) return Close();  // no word before the handshake
  AnswerAndClose(503, "too many connections: close other tabs of this view");
}

void HttpConnection::Answer(HttpResponse response) {
  if (closed_) return;
  if (!response.file.empty()) return AnswerFile(std::move(response));
  if (is_head_) return AnswerHead(response);
  AnswerBody(std::move(response));
}

template <class Body>
void HttpConnection::SetFields(const HttpResponse& response, http::response<Body>* message) const {
  message->version(11);
  message->result(static_cast<unsigned>(response.status));
  message->keep_alive(keep_alive_);
  message->set(http::field::content_type, response.content_type);
  message->set(http::field::cache_control,
               response.immutable ? "private, max-age=31536000, immutable" : "no-cache");
  message->set("Content-Security-Policy", kPolicy);
  message->set("X-Content-Type-Options", "nosniff");
  message->set("Referrer-Policy", "no-referrer");
  message->set("Cross-Origin-Resource-Policy", "same-origin");
  message->set("Permissions-Policy", kPermissions);
  if (response.gzipped) message->set(http::field::content_encoding, "gzip");
  if (response.gzipped) message->set(http::field::vary, "Accept-Encoding");
  for (const auto& [name, value] : response.fields) message->set(name, value);
  if (response.status == 405) message->set(http::field::allow, "GET, HEAD");
  if (response.ranges) message->set(http::field::accept_ranges, "bytes");
  if (!response.download_name.empty()) {
    message->set(http::field::content_disposition,
                 "attachment; filename=\"" + response.download_name + "\"");
  }
}

// Opened and read by jobs: a disk that hangs holds up this connection alone.
void HttpConnection::AnswerFile(HttpResponse response) {
  const auto file = std::make_shared<OutgoingFile>();
  file->content = std::move(response);
  due_since_s_ = MonotonicS();
  host_.RunJob([file, next = host_.OnServer(id_, [file](HttpConnection& self, auto failure) {
    failure ? self.Answer(std::move(*failure)) : self.BeginFile(file);
  })] {
    file->Open() ? next(std::nullopt)
                 : next(HttpError(404, "cannot be read: " + file->error.message()));
  });
}

void HttpConnection::BeginFile(const std::shared_ptr<OutgoingFile>& file) {
  if (is_head_) {
    auto outgoing = std::make_shared<Outgoing<http::empty_body>>();
    SetFields(file->content, &outgoing->message);
    outgoing->content = file->content;
    outgoing->message.content_length(file->size_bytes);
    return Write(outgoing);
  }
  SetFields(file->content, &file->message);
  file->message.content_length(file->size_bytes);
  file->serializer.emplace(file->message);
  answering_since_s_ = MonotonicS();
  WriteFilePart(file);
}

void HttpConnection::ReadFilePart(const std::shared_ptr<OutgoingFile>& file) {
  due_since_s_ = MonotonicS();
  host_.RunJob([file, next = host_.OnServer(id_, [file](HttpConnection& self, auto failure) {
    file->error || failure ? self.Close() : self.WriteFilePart(file);
  })] {
    file->Read();
    next(std::nullopt);
  });
}

void HttpConnection::WriteFilePart(const std::shared_ptr<OutgoingFile>& file) {
  auto& body = file->message.body();
  body.data = file->part.data();
  body.size = file->part.size();
  body.more = file->left_bytes > 0;
  due_since_s_.reset();
  WriteSome(file);
}

void HttpConnection::AnswerHead(const HttpResponse& response) {
  auto outgoing = std::make_shared<Outgoing<http::empty_body>>();
  SetFields(response, &outgoing->message);
  outgoing->message.content_length(response.bytes ? response.bytes->size() : response.text.size());
  Write(outgoing);
}

void HttpConnection::AnswerBody(HttpResponse response) {
  using Body = http::span_body<const char>;
  auto outgoing = std::make_shared<Outgoing<Body>>();
  outgoing->content = std::move(response);
  HttpResponse& content = outgoing->content;
  const char* data =
      content.bytes ? reinterpret_cast<const char*>(content.bytes->data()) : content.text.data();
  const size_t size = content.bytes ? content.bytes->size() : content.text.size();
  ByteRange part{0, size};
  if (content.ranges && content.status == 200) {
    const RangeAnswer range = ParseRange(range_, size);
    content.status = range.status;
    part = range.range;
  }
  SetFields(content, &outgoing->message);
  if (content.status == 206) {
    outgoing->message.set(http::field::content_range,
                          "bytes " + std::to_string(part.first) + "-" +
                              std::to_string(part.first + part.length - 1) + "/" +
                              std::to_string(size));
  } else if (content.status == 416) {
    outgoing->message.set(http::field::content_range, "bytes */" + std::to_string(size));
  }
  outgoing->message.body() = {data + part.first, part.length};
  outgoing->message.prepare_payload();
  Write(outgoing);
}

template <class Outgoing>
void HttpConnection::Write(std::shared_ptr<Outgoing> outgoing) {
  waiting_since_s_.reset();
  due_since_s_.reset();
  answering_since_s_ = MonotonicS();
  outgoing->serializer.emplace(outgoing->message);
  WriteSome(std::move(outgoing));
}

// Part by part: who takes nothing for as long as a connection may be idle is closed.
template <class Outgoing>
void HttpConnection::WriteSome(std::shared_ptr<Outgoing> outgoing) {
  stream_.lowest().expires_after(Milliseconds(host_.options().bounds.idle_s));
  http::async_write_some(stream_, *outgoing->serializer,
                         [self = shared_from_this(), outgoing](ErrorCode error, size_t) mutable {
                           if constexpr (std::is_same_v<Outgoing, OutgoingFile>) {
                             if (error == http::error::need_buffer)
                               return self->ReadFilePart(outgoing);
                           }
                           if (error && error != http::error::end_of_stream) return self->Close();
                           if (outgoing->serializer->is_done()) return self->OnWritten();
                           self->WriteSome(std::move(outgoing));
                         });
}

void HttpConnection::OnWritten() {
  answering_since_s_.reset();
  if (closed_) return;
  if (keep_alive_) return ReadRequest();
  ErrorCode ignored;
  stream_.lowest().socket().shutdown(tcp::socket::shutdown_send, ignored);
  waiting_since_s_ = MonotonicS();
  stream_.lowest().expires_after(Milliseconds(kLingerS));
  Linger(kMaxLingerBytes);
}

// What the peer still sends is read: closing before would reset the connection, and the peer might
// lose the answer.
void HttpConnection::Linger(size_t max_bytes) {
  stream_.async_read_some(asio::buffer(lingering_),
                          [self = shared_from_this(), max_bytes](ErrorCode error, size_t size) {
                            if (error || size >= max_bytes) return self->Close();
                            self->Linger(max_bytes - size);
                          });
}

void HttpConnection::Close() {
  if (closed_) return;
  closed_ = true;
  sink_.reset();
  stream_.lowest().close();
  host_.OnClosed(id_);
}

}  // namespace skein
