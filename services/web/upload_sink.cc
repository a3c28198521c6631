#include "web/upload_sink.h"

#include <charconv>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <utility>

#include "core/hash.h"
#include "photo/exif.h"

namespace skein {
namespace {

constexpr char kRetryAfterS[] = "5";

std::optional<int64_t> IntegerField(const HttpRequest& request, const char* name) {
  const auto field = request.fields.find(name);
  if (field == request.fields.end()) return std::nullopt;
  const std::string& text = field->second;
  int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || value < 0) return std::nullopt;
  return value;
}

// "47.5,8.2,430", or "47.5,8.2," where the altitude is not known. False where it makes no sense.
bool ReadGps(const std::string& text, UploadInfo* info) {
  double values[3] = {0, 0, 0};
  const bool has_altitude = !text.empty() && text.back() != ',';
  const char* at = text.c_str();
  for (int count = 0; count < 3; ++count) {
    if (count > 0 && *at++ != ',') return false;
    if (count == 2 && *at == '\0') break;
    char* end = nullptr;
    values[count] = std::strtod(at, &end);
    if (end == at || !std::isfinite(values[count])) return false;
    at = end;
  }
  const bool is_place =
      std::abs(values[0]) <= 90 && std::abs(values[1]) <= 180 && std::abs(values[2]) <= kHighestM;
  if (*at != '\0' || !is_place) return false;
  info->has_gps = true;
  info->latitude_deg = values[0];
  info->longitude_deg = values[1];
  if (has_altitude) info->altitude_m = values[2];
  return true;
}

int StatusOfUpload(StatusCode code) {
  switch (code) {
    case StatusCode::kAlreadyExists:
      return 409;
    case StatusCode::kResourceExhausted:
      return 413;
    case StatusCode::kUnavailable:
      return 503;
    case StatusCode::kDataLoss:
      return 422;
    default:
      return 400;
  }
}

HttpResponse UploadError(const Status& status) {
  HttpResponse response = HttpError(StatusOfUpload(status.code), status.error());
  if (response.status == 503) response.fields.emplace_back("Retry-After", kRetryAfterS);
  return response;
}

void AddProgress(const UploadStore::Progress& progress, HttpResponse* response) {
  response->fields.emplace_back("Upload-Offset", std::to_string(progress.received_bytes));
  response->fields.emplace_back("Upload-Length", std::to_string(progress.size_bytes));
  if (progress.is_stored) response->fields.emplace_back("Upload-Stored", "1");
}

class UploadSink : public BodySink, public std::enable_shared_from_this<UploadSink> {
 public:
  UploadSink(UploadStore& store, JobPool& pool, const HttpRequest& request, std::string blob_id)
      : store_(store), pool_(pool), request_(request), blob_id_(std::move(blob_id)) {}

  // The connection is lost, or the answer given.
  ~UploadSink() override {
    if (receiver_) store_.Leave(*receiver_);
  }

  void Begin(Next next) override {
    pool_.Run([self = shared_from_this(), next = std::move(next)] { next(self->DoBegin()); });
  }
  void Take(Bytes part, Next next) override {
    pool_.Run([self = shared_from_this(), part = std::move(part), next = std::move(next)] {
      next(self->DoTake(part));
    });
  }
  void End(Next next) override {
    pool_.Run([self = shared_from_this(), next = std::move(next)] { next(self->DoEnd()); });
  }

 private:
  std::optional<HttpResponse> DoBegin() {
    const auto offset = IntegerField(request_, "upload-offset");
    const auto length = IntegerField(request_, "upload-length");
    const auto name = request_.fields.find("upload-name");
    const std::optional<HttpRequest> decoded =
        name == request_.fields.end() ? std::nullopt : ParseTarget("/" + name->second);
    if (!offset || !length || !decoded) {
      return HttpError(400, "give Upload-Offset, Upload-Length and Upload-Name (percent-encoded)");
    }
    if (request_.body_bytes > static_cast<uint64_t>(*length) ||
        static_cast<uint64_t>(*offset) > static_cast<uint64_t>(*length) - request_.body_bytes) {
      return HttpError(413, "the body is longer than what is left of the photo");
    }
    UploadInfo info;
    info.name = decoded->path.substr(1);
    info.size_bytes = *length;
    info.capture_utime_us = IntegerField(request_, "upload-taken").value_or(0);
    const auto gps = request_.fields.find("upload-gps");
    if (gps != request_.fields.end() && !ReadGps(gps->second, &info)) {
      return HttpError(400,
                       "Upload-Gps: give latitude,longitude,altitude in degrees and metres; an "
                       "altitude that is not known is empty");
    }
    Result<UploadStore::Receiver> begun =
        store_.Begin(request_.visitor.name, blob_id_, info, *offset);
    if (!begun.ok()) return UploadError(begun.status());
    receiver_ = *begun;
    progress_ = {*offset, *length, false};
    return std::nullopt;
  }

  std::optional<HttpResponse> DoTake(const Bytes& part) {
    const Result<UploadStore::Progress> progress = store_.Take(*receiver_, part);
    if (!progress.ok()) return UploadError(progress.status());
    progress_ = *progress;
    return std::nullopt;
  }

  std::optional<HttpResponse> DoEnd() {
    HttpResponse response;
    if (progress_.received_bytes == progress_.size_bytes) {
      if (Status done = store_.Finish(*receiver_); !done.ok()) return UploadError(done);
      progress_.is_stored = true;
      response = JsonResponse("{\"received\":" + std::to_string(progress_.size_bytes) + "}");
      response.status = 201;
    } else {
      response.status = 200;
      response.text = "{\"received\":" + std::to_string(progress_.received_bytes) + "}";
    }
    AddProgress(progress_, &response);
    return response;
  }

  UploadStore& store_;
  JobPool& pool_;
  const HttpRequest request_;
  const std::string blob_id_;
  std::optional<UploadStore::Receiver> receiver_;
  UploadStore::Progress progress_;
};

}  // namespace

std::shared_ptr<BodySink> MakeUploadSink(UploadStore& store, JobPool& pool,
                                         const HttpRequest& request, const std::string& blob_id) {
  return std::make_shared<UploadSink>(store, pool, request, blob_id);
}

HttpResponse UploadHead(const std::optional<UploadStore::Progress>& here, bool is_in_ledger) {
  HttpResponse response = JsonResponse("");
  if (is_in_ledger) {
    response.fields.emplace_back("Upload-Stored", "1");
    return response;
  }
  if (!here) return HttpError(404, "nothing of this photo has come yet");
  AddProgress(*here, &response);
  return response;
}

}  // namespace skein
