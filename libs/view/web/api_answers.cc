#include "web/api_answers.h"

#include <charconv>
#include <utility>

namespace skein {
namespace {

int StatusOf(StatusCode code) {
  switch (code) {
    case StatusCode::kNotFound:
      return 404;
    case StatusCode::kUnavailable:
      return 503;
    case StatusCode::kInvalidArgument:
      return 400;
    default:
      return 500;
  }
}

}  // namespace

std::optional<int64_t> ParseId(const std::string& text) {
  int64_t id = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), id);
  if (error != std::errc() || end != text.data() + text.size() || id < 0) return std::nullopt;
  return id;
}

void AnswerError(const Respond& respond, const Status& status) {
  respond(HttpError(StatusOf(status.code), status.error()));
}

HttpResponse NoSuch(const std::string& what) { return HttpError(404, "there is no " + what); }

HttpResponse BytesResponse(std::shared_ptr<const Bytes> bytes, const std::string& type) {
  HttpResponse response;
  response.content_type = type;
  response.bytes = std::move(bytes);
  return response;
}

}  // namespace skein
