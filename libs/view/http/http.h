// Requests and answers of the live view's server, without sockets.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "auth/certificate.h"
#include "core/bytes.h"

namespace skein {

// Sender of a request, as access.h takes it.
struct Visitor {
  bool is_local = false;     // by the server's own port
  std::optional<Role> role;  // of its pass; none without a pass that holds
  std::string name;          // of its pass
  int64_t expires_s = 0;     // of its pass, seconds since 1970; 0: never
  std::string refusal{};     // why a pass that was shown does not hold; "" without one
};

struct HttpRequest {
  std::string method = "GET";
  std::string path;                           // percent-decoded, begins with '/'
  std::map<std::string, std::string> query;   // percent-decoded; the last of equal keys
  std::map<std::string, std::string> fields;  // upload-*, in small letters
  uint64_t body_bytes = 0;                    // as the header says
  std::string body;                           // of a POST
  Visitor visitor;
  bool is_public = false;     // came by a public port
  bool is_encrypted = false;  // by TLS
  bool takes_gzip = false;
};

// Its body is text, bytes or a file.
struct HttpResponse {
  int status = 200;
  std::string content_type = "application/json";
  std::string text;
  std::shared_ptr<const Bytes> bytes;  // before text, if not null
  std::filesystem::path file;          // before both, if not empty
  std::filesystem::path file_root;     // the file lies below it; opened as core/file_below.h does
  bool immutable = false;              // the content of this URL never changes
  bool ranges = false;                 // of bytes: a part may be asked for
  std::shared_ptr<const void> keep;    // lives until it was sent
  std::string download_name;           // name under which a browser saves it; "": the browser shows
                                       // it
  bool gzipped = false;                // the file is compressed
  std::vector<std::pair<std::string, std::string>> fields;  // more of the header
};

// Response with the status, and a line that says what to do.
HttpResponse HttpError(int status, const std::string& line);
HttpResponse JsonResponse(std::string text);

// Receiver of a PATCH's body, part by part. A part is given once the one before was taken. Ends
// with End, or is destroyed where the connection is lost.
class BodySink {
 public:
  // Called once, from any thread: none to go on, or the answer, which ends the request.
  using Next = std::function<void(std::optional<HttpResponse>)>;

  virtual ~BodySink() = default;
  virtual void Begin(Next next) = 0;
  virtual void Take(Bytes part, Next next) = 0;
  // All of the body was taken: the answer is due.
  virtual void End(Next next) = 0;
};
// Null: nothing may be uploaded there. On the server's thread.
using SinkMaker = std::function<std::shared_ptr<BodySink>(const HttpRequest&)>;

// Answers a request, once, from any thread.
using Respond = std::function<void(HttpResponse)>;

// Answers the server's requests. On the server's thread, so it must not block.
using HttpHandler = std::function<void(const HttpRequest&, Respond)>;

// The target of a request line, e.g. "/api/events?from=3". nullopt if it is malformed: not
// absolute, a bad escape, a zero byte.
std::optional<HttpRequest> ParseTarget(std::string_view target);

// By a file's name; "application/octet-stream" for what is not known.
std::string ContentTypeOf(const std::string& name);

// A part of a body: first byte and length.
struct ByteRange {
  uint64_t first = 0;
  uint64_t length = 0;
};
struct RangeAnswer {
  int status = 200;  // 200: the whole; 206: `range`; 416: none of it is there
  ByteRange range;
};
// For a Range header (RFC 9110, 14.2) and a body of that size. Several parts, other units and what
// is malformed give the whole, as the RFC allows.
RangeAnswer ParseRange(std::string_view header, uint64_t size);

}  // namespace skein
