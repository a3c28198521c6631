#include "web/http_connection.h"

#include <utility>

#include "core/clock.h"
#include "web/access.h"

namespace skein {
namespace {

constexpr char kPolicy[] =
    "default-src 'self'; img-src 'self' blob: data:; style-src 'self'; script-src 'self'";

constexpr double kLingerS = 2;
constexpr size_t kMaxLingerBytes = 1 << 20;

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

HttpConnection::HttpConnection(ConnectionHost& host, int64_t id, tcp::socket socket)
    : host_(host),
      id_(id),
      stream_(std::move(socket)),
      buffer_(static_cast<size_t>(host.options().max_header_bytes) * 2) {}

void HttpConnection::ReadRequest() {
  waiting_since_s_ = MonotonicS();
  parser_.emplace();
  parser_->header_limit(static_cast<uint32_t>(host_.options().max_header_bytes));
  stream_.expires_after(Milliseconds(host_.options().idle_s));
  http::async_read_header(stream_, buffer_, *parser_,
                          [self = shared_from_this()](ErrorCode error, size_t) {
                            error ? self->OnBadRequest(error) : self->OnRequest();
                          });
}

void HttpConnection::OnBadRequest(ErrorCode error) {
  if (error == http::error::header_limit || error == http::error::buffer_overflow) {
    return AnswerAndClose(431, "the request's header is too large: at most " +
                                   std::to_string(host_.options().max_header_bytes) + " bytes");
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
  const bool is_websocket = websocket::is_upgrade(request);
  ErrorCode error;
  const AccessDecision access =
      DecideAccess({std::string(request.method_string()), Header(request, http::field::host),
                    Header(request, http::field::origin),
                    stream_.socket().local_endpoint(error).address().to_string(), is_websocket});
  if (!access.allowed()) return AnswerAndClose(access.status, access.reason);
  if (parser_->content_length().value_or(0) > 0 || parser_->chunked()) {
    return AnswerAndClose(413, "a request has no body here");
  }
  const std::optional<HttpRequest> target =
      ParseTarget({request.target().data(), request.target().size()});
  if (!target) return AnswerAndClose(400, "the request's target is malformed");
  if (!is_websocket) return host_.Handle(id_, *target);
  if (target->path != "/ws") return AnswerAndClose(404, "the WebSocket is at /ws");
  closed_ = true;  // what goes on is no longer this
  host_.Upgrade(id_, std::move(stream_), parser_->release());
}

void HttpConnection::AnswerAndClose(int status, const std::string& line) {
  waiting_since_s_.reset();
  keep_alive_ = false;
  range_.clear();
  Answer(HttpError(status, line));
}

void HttpConnection::Refuse() {
  AnswerAndClose(503, "too many connections: close other tabs of this view");
}

void HttpConnection::Answer(HttpResponse response) {
  if (closed_) return;
  if (!response.file.empty()) return AnswerFile(response);
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
  if (response.status == 405) message->set(http::field::allow, "GET, HEAD");
  if (response.ranges) message->set(http::field::accept_ranges, "bytes");
  if (!response.download_name.empty()) {
    message->set(http::field::content_disposition,
                 "attachment; filename=\"" + response.download_name + "\"");
  }
}

void HttpConnection::AnswerFile(const HttpResponse& response) {
  http::file_body::value_type body;
  ErrorCode error;
  body.open(response.file.c_str(), beast::file_mode::scan, error);
  if (error) {
    HttpResponse failure = HttpError(404, "cannot be read: " + error.message());
    return is_head_ ? AnswerHead(failure) : AnswerBody(std::move(failure));
  }
  if (is_head_) {
    auto outgoing = std::make_shared<Outgoing<http::empty_body>>();
    SetFields(response, &outgoing->message);
    outgoing->content = response;
    outgoing->message.content_length(body.size());
    return Write(outgoing);
  }
  auto outgoing = std::make_shared<Outgoing<http::file_body>>();
  SetFields(response, &outgoing->message);
  outgoing->content = response;
  outgoing->message.body() = std::move(body);
  outgoing->message.prepare_payload();
  Write(outgoing);
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
  outgoing->serializer.emplace(outgoing->message);
  WriteSome(std::move(outgoing));
}

// Part by part: who takes nothing for as long as a connection may be idle is closed.
template <class Outgoing>
void HttpConnection::WriteSome(std::shared_ptr<Outgoing> outgoing) {
  stream_.expires_after(Milliseconds(host_.options().idle_s));
  http::async_write_some(stream_, *outgoing->serializer,
                         [self = shared_from_this(), outgoing](ErrorCode error, size_t) mutable {
                           if (error && error != http::error::end_of_stream) return self->Close();
                           if (outgoing->serializer->is_done()) return self->OnWritten();
                           self->WriteSome(std::move(outgoing));
                         });
}

void HttpConnection::OnWritten() {
  if (closed_) return;
  if (keep_alive_) return ReadRequest();
  ErrorCode ignored;
  stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
  waiting_since_s_ = MonotonicS();
  stream_.expires_after(Milliseconds(kLingerS));
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
  stream_.close();
  host_.OnClosed(id_);
}

}  // namespace skein
