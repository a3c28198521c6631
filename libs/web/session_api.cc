#include "web/session_api.h"

#include <algorithm>
#include <charconv>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <utility>

#include "blobs/blob_store.h"
#include "core/file.h"
#include "core/log.h"
#include "export/model_writer.h"
#include "export/models_zip.h"
#include "export/temporary_folder.h"
#include "formats/formats.h"
#include "ledger/fact_ids.h"
#include "session/diagnosis.h"
#include "transport/invitation.h"
#include "web/events.h"
#include "web/page_shape.h"
#include "web/qr_code.h"
#include "web/upload_sink.h"

namespace skein {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

constexpr size_t kMaxStates = 500;
constexpr int kPixelDigits = 6, kPointDigits = 9;

std::optional<int64_t> ParseId(const std::string& text) {
  int64_t id = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), id);
  if (error != std::errc() || end != text.data() + text.size() || id < 0) return std::nullopt;
  return id;
}

std::vector<std::string> SplitPath(const std::string& path) {
  std::vector<std::string> parts;
  size_t begin = 1;
  while (begin <= path.size()) {
    const size_t end = std::min(path.find('/', begin), path.size());
    parts.push_back(path.substr(begin, end - begin));
    begin = end + 1;
  }
  return parts;
}

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

// Of the one download that is being made: freed before it is answered, or when nobody can answer it
// any more.
class DownloadSlot {
 public:
  explicit DownloadSlot(std::atomic<bool>* taken) : taken_(taken) {}
  ~DownloadSlot() { Free(); }
  void Free() {
    if (!freed_.exchange(true)) *taken_ = false;
  }

 private:
  std::atomic<bool>* const taken_;
  std::atomic<bool> freed_{false};
};

json PointJson(const Keypoint& keypoint) {
  return {Rounded(keypoint.x, kPixelDigits), Rounded(keypoint.y, kPixelDigits)};
}

// A phone installs it, and tells by its ending what it is.
void GetCertificate(const PublicAddresses& addresses, const Respond& respond) {
  if (addresses.certificate_der.empty()) return respond(NoSuch("certificate"));
  HttpResponse response = BytesResponse(std::make_shared<const Bytes>(addresses.certificate_der),
                                        "application/x-x509-ca-cert");
  response.download_name = "skein.crt";
  respond(std::move(response));
}

// What the ledger says of a photo that an agent sent; null: nothing.
json LedgerState(const SessionRecord& session, const std::string& agent, const std::string& name,
                 const std::string& blob_id) {
  const PhotoState* photo = session.state.FindPhoto(session.history.FindImageByBlob(blob_id));
  if (photo == nullptr) {
    const failure_t* refused =
        session.history.FindFailure(RefusedOfferFactId(agent, name, blob_id));
    if (refused == nullptr) return nullptr;
    return {{"state", "refused"}, {"reason", refused->reason}};
  }
  const int64_t image_id = photo->image.image_id;
  const bool is_own = photo->image.agent == agent;
  json state = {{"state", "waiting"}, {"reason", ""}};
  if (is_own) state["image"] = image_id;
  if (session.state.IsRegistered(image_id)) {
    state["state"] = "placed";
    return state;
  }
  const Diagnosis diagnosis = Diagnose(session.state, *photo);
  if (diagnosis.cause == Diagnosis::Cause::kWaiting) return state;
  const bool has_failed = diagnosis.cause == Diagnosis::Cause::kFailed;
  state.update({{"state", has_failed ? "failed" : "unplaced"},
                {"reason", diagnosis.what},
                {"remedy", diagnosis.remedy}});
  return state;
}

}  // namespace

SessionApi::SessionApi(const SessionView& view, SessionSource source, int num_threads)
    : view_(view), source_(std::move(source)), page_(source_.page_dir), pool_(num_threads) {}

std::string SessionApi::ShapeMessage(int64_t submap_id, uint64_t version) {
  return json({{"type", "shape"}, {"submap", submap_id}, {"version", version}}).dump();
}

std::string SessionApi::GoneMessage(int64_t submap_id) {
  return json({{"type", "shape"}, {"submap", submap_id}, {"gone", true}}).dump();
}

void SessionApi::Handle(const HttpRequest& request, Respond respond) {
  Parts parts = SplitPath(request.path);
  const std::string first = parts.empty() ? "" : parts.front();
  if (first != "api" && first != "download") {
    if (request.path == "/skein.crt") return GetCertificate(source_.addresses, respond);
    pool_.Run([this, path = request.path, takes_gzip = request.takes_gzip, respond] {
      respond(page_.Get(path, takes_gzip));
    });
    return;
  }
  parts.erase(parts.begin());
  first == "api" ? HandleApi(parts, request, respond) : Download(parts, respond);
}

void SessionApi::HandleApi(const Parts& parts, const HttpRequest& request, Respond respond) {
  const std::string what = parts.empty() ? "" : parts.front();
  const bool alone = parts.size() == 1;
  if (what == "session" && alone) return GetSession(request, respond);
  if (what == "uploads" && parts.size() == 2) return Uploads(parts, request, respond);
  if (what == "invitations" && alone) return Invite(request, respond);
  if (what == "finish" && alone) return AskToFinish(respond);
  if (what == "events" && alone) return GetEvents(request, respond);
  if (what == "report" && alone) return GetReport(respond);
  if (what == "submaps" && parts.size() >= 2) return Submaps(parts, request, respond);
  if (what == "photos" && parts.size() >= 2) return Photos(parts, respond);
  respond(HttpError(404, "there is no such path; /api/session is one"));
}

void SessionApi::GetSession(const HttpRequest& request, Respond respond) const {
  const std::string folder =
      source_.session_dir.empty() ? "" : fs::absolute(source_.session_dir).filename().string();
  json answer = {{"session_id", source_.session_id},
                 {"folder", folder},
                 {"live", source_.live},
                 {"version", SKEIN_VERSION},
                 {"head", view_.events().head()},
                 {"page_limits", {{"points", kPagePoints}}},
                 {"visitor", nullptr},
                 {"invites", source_.invite != nullptr}};
  if (request.visitor.role) {
    answer["visitor"] = {{"role", RoleName(*request.visitor.role)}, {"name", request.visitor.name}};
  }
  if (!source_.addresses.secure.empty()) {
    answer["addresses"] = {{"secure", source_.addresses.secure},
                           {"plain", source_.addresses.plain},
                           {"fingerprint", source_.addresses.fingerprint}};
  }
  respond(JsonResponse(answer.dump(-1, ' ', false, json::error_handler_t::replace)));
}

std::shared_ptr<BodySink> SessionApi::MakeSink(const HttpRequest& request) {
  const Parts parts = SplitPath(request.path);
  const bool is_upload = parts.size() == 3 && parts[0] == "api" && parts[1] == "uploads";
  if (!is_upload || source_.uploads == nullptr) return nullptr;
  return MakeUploadSink(*source_.uploads, uploading_, request, parts[2]);
}

std::string SessionApi::AgentOfPhoto(int64_t image_id) const {
  return view_.With([&](const SessionRecord& session) {
    const PhotoState* photo = session.state.FindPhoto(image_id);
    return photo == nullptr ? std::string() : photo->image.agent;
  });
}

void SessionApi::Uploads(const Parts& parts, const HttpRequest& request, Respond respond) {
  if (source_.uploads == nullptr) return respond(HttpError(404, "nothing is uploaded here"));
  if (request.method == "POST" && parts[1] == "states") {
    return uploading_.Run([this, request, respond] { GetUploadStates(request, respond); });
  }
  if (request.method != "HEAD") return respond(HttpError(404, "there is no such path"));
  uploading_.Run([this, agent = request.visitor.name, blob_id = parts[1], respond] {
    const bool is_in_ledger = view_.With([&](const SessionRecord& session) {
      return session.history.FindImageByBlob(blob_id) != 0;
    });
    respond(UploadHead(*source_.uploads, agent, blob_id, is_in_ledger));
  });
}

// {"photos": [[SHA256, name], ...]} -> {"states": [...]}, in the same order.
void SessionApi::GetUploadStates(const HttpRequest& request, const Respond& respond) const {
  const json asked = json::parse(request.body, nullptr, false);
  if (!asked.is_object() || !asked.contains("photos") || !asked["photos"].is_array() ||
      asked["photos"].size() > kMaxStates) {
    return respond(HttpError(
        400, "give {\"photos\": [[SHA256, name], ...]}, at most " + std::to_string(kMaxStates)));
  }
  const std::string& agent = request.visitor.name;
  std::map<std::string, UploadStore::Progress> here = source_.uploads->ProgressOf(agent);
  const std::string wait_reason = source_.uploads->WaitReason(agent);
  json states = json::array();
  for (const json& photo : asked["photos"]) {
    const bool is_pair =
        photo.is_array() && photo.size() == 2 && photo[0].is_string() && photo[1].is_string();
    if (!is_pair) return respond(HttpError(400, "a photo is [SHA256, name]"));
    const std::string blob_id = photo[0], name = photo[1];
    json state = view_.With(
        [&](const SessionRecord& session) { return LedgerState(session, agent, name, blob_id); });
    const auto progress = here.find(blob_id);
    if (state.is_null() && progress != here.end()) {
      state = progress->second.is_stored
                  ? json({{"state", "received"}, {"reason", wait_reason}})
                  : json({{"state", "receiving"}, {"offset", progress->second.received_bytes}});
    }
    states.push_back(state.is_null() ? json({{"state", "unknown"}}) : std::move(state));
  }
  respond(JsonResponse(
      json({{"states", std::move(states)}}).dump(-1, ' ', false, json::error_handler_t::replace)));
}

void SessionApi::Invite(const HttpRequest& request, Respond respond) {
  if (!source_.invite) {
    return respond(HttpError(404,
                             "nobody is let in from elsewhere: start the session with "
                             "launch.sh --web-public HOST"));
  }
  const json asked = json::parse(request.body, nullptr, false);
  const bool is_sound = asked.is_object() && asked.value("role", json()).is_string() &&
                        asked.value("name", json("")).is_string();
  const std::string role = is_sound ? asked["role"].get<std::string>() : "";
  const std::string name = is_sound ? asked.value("name", std::string()) : "";
  if (role != "agent" && role != "viewer") {
    return respond(HttpError(400, "role: give agent or viewer; `skein invite` makes the others"));
  }
  if (!name.empty() && !IsInvitedName(name)) {
    return respond(HttpError(400, "name: give 1 to 24 letters, digits, '-' or '_'"));
  }
  pool_.Run([this, role, name, respond] {
    const Result<WebInvitation> made = source_.invite(*RoleFromName(role), name);
    if (!made.ok()) return AnswerError(respond, made.status());
    const std::string& link = made->plain_link.empty() ? made->secure_link : made->plain_link;
    json answer = {{"name", made->name},
                   {"secure", {{"link", made->secure_link}, {"qr", QrModules(made->secure_link)}}},
                   {"plain", nullptr}};
    if (!made->plain_link.empty()) answer["plain"] = {{"link", link}, {"qr", QrModules(link)}};
    respond(JsonResponse(answer.dump()));
  });
}

void SessionApi::AskToFinish(const Respond& respond) {
  if (!source_.finish) return respond(HttpError(404, "the session is not finished from here"));
  source_.finish([respond](const Status& status) {
    if (!status.ok()) return AnswerError(respond, status);
    HttpResponse response = JsonResponse("{\"finish\":\"requested\"}");
    response.status = 202;
    respond(std::move(response));
  });
}

void SessionApi::GetEvents(const HttpRequest& request, Respond respond) const {
  const auto from = request.query.find("from");
  const std::optional<int64_t> seq = from == request.query.end() ? 1 : ParseId(from->second);
  if (!seq) return respond(HttpError(400, "from: give the number of an event"));
  const EventLog::Page page = view_.events().Get(*seq);
  respond(JsonResponse("{\"head\":" + std::to_string(page.head) + ",\"next\":" +
                       std::to_string(page.next) + ",\"events\":[" + page.events + "]}"));
}

void SessionApi::GetReport(Respond respond) const {
  if (source_.session_dir.empty()) {
    return respond(HttpError(404, "report.json is in the session folder, on its host"));
  }
  HttpResponse response;
  response.file = SessionPaths{source_.session_dir}.Report();
  if (!fs::exists(response.file)) {
    return respond(HttpError(404, "there is no report before the first `skein finish`"));
  }
  respond(std::move(response));
}

void SessionApi::Fetch(const std::string& blob_id, const std::string& owner,
                       SessionSource::Done done) {
  pool_.Run(
      [this, blob_id, owner, done = std::move(done)] { source_.fetch(blob_id, owner, done); });
}

void SessionApi::FetchAll(const std::vector<std::string>& blob_ids, const std::string& owner,
                          const Respond& respond, std::function<void(const Blobs&)> then) {
  struct Gathered {
    std::mutex mutex;
    Blobs blobs;
    size_t num_left = 0;
    bool failed = false;
  };
  const std::set<std::string> wanted(blob_ids.begin(), blob_ids.end());
  const auto gathered = std::make_shared<Gathered>();
  gathered->num_left = wanted.size();
  for (const std::string& id : wanted) {
    Fetch(id, owner, [this, gathered, id, respond, then](Result<Bytes> bytes) {
      const std::lock_guard<std::mutex> lock(gathered->mutex);
      if (gathered->failed) return;
      if (!bytes.ok()) {
        gathered->failed = true;
        return AnswerError(respond, bytes.status());
      }
      gathered->blobs[id] = std::move(*bytes);
      if (--gathered->num_left > 0) return;
      pool_.Run([gathered, then] { then(gathered->blobs); });
    });
  }
}

void SessionApi::Submaps(const Parts& parts, const HttpRequest& request, Respond respond) {
  const std::optional<int64_t> id = ParseId(parts[1]);
  if (!id) return respond(HttpError(400, "a submap is a number"));
  source_.on_look();
  WithShape(*id, respond, [this, parts, request, respond](const ShapePtr& shape) {
    if (parts.size() == 2) return respond(JsonResponse(ShapeJson(*shape)));
    if (parts[2] == "chunks" && parts.size() >= 4) {
      return GetChunk(*shape, parts, request, respond);
    }
    respond(HttpError(404, "there is no such path; /api/submaps/ID is one"));
  });
}

// A mapper's shape, where there is one; else that of the newest model.
void SessionApi::WithShape(int64_t submap_id, const Respond& respond,
                           std::function<void(ShapePtr)> then) {
  struct Model {
    bool known = false, ended = false;
    int64_t merged_into = 0;
    std::string blob;
    int64_t utime_us = 0;
  };
  const Model model = view_.With([&](const SessionRecord& session) {
    const SubmapLife* submap = session.state.FindSubmap(submap_id);
    if (submap == nullptr) return Model();
    Model found{true, submap->ended, submap->merged_into, "", 0};
    if (submap->latest_model) {
      found.blob = submap->latest_model->model_blob;
      found.utime_us = submap->latest_model->header.utime_us;
    }
    return found;
  });
  const std::string name = "submap " + std::to_string(submap_id);
  if (!model.known) return respond(NoSuch(name));
  if (model.ended) {
    return respond(HttpError(
        404, name + " has ended" +
                 (model.merged_into == 0
                      ? ""
                      : "; submap " + std::to_string(model.merged_into) + " has its photos")));
  }
  const ShapePtr shape = shapes_.Find(submap_id);
  const bool is_current =
      shape != nullptr &&
      (shape->model_blob == model.blob || shape->version >= static_cast<uint64_t>(model.utime_us) ||
       !source_.may_use_model(submap_id));
  if (is_current) return then(shape);
  if (model.blob.empty() || !source_.may_use_model(submap_id)) {
    return respond(HttpError(404, name + " has no shape yet: ask again"));
  }
  FetchAll({model.blob}, "ingest", respond,
           [this, submap_id, model, respond, then](const Blobs& blobs) {
             const Result<ShapePtr> made =
                 ShapeOfModel(submap_id, model.blob, blobs.at(model.blob), model.utime_us);
             if (!made.ok()) return AnswerError(respond, made.status());
             if (!shapes_.Set(*made)) LogWarn("submap {}: no room for its shape", submap_id);
             then(*made);
           });
}

void SessionApi::GetChunk(const Shape& shape, const Parts& parts, const HttpRequest& request,
                          Respond respond) {
  const std::optional<int64_t> id = ParseId(parts[3]);
  const Shape::Chunk* chunk = id ? shape.Find(static_cast<uint64_t>(*id)) : nullptr;
  if (chunk == nullptr) return respond(NoSuch("such chunk in the newest shape"));
  const auto version = request.query.find("v");
  const std::optional<int64_t> wanted =
      version == request.query.end() ? std::nullopt : ParseId(version->second);
  if (!wanted) return respond(HttpError(400, "v: give the chunk's version"));
  if (static_cast<uint64_t>(*wanted) != chunk->version) {
    HttpResponse gone;
    gone.status = 404;
    gone.text =
        json({{"error", "this version is gone: take the newest one"}, {"version", chunk->version}})
            .dump();
    return respond(std::move(gone));
  }
  if (parts.size() == 4) {
    HttpResponse response = BytesResponse(chunk->points, "application/octet-stream");
    response.immutable = true;
    response.ranges = true;
    return respond(std::move(response));
  }
  const std::optional<int64_t> index = parts.size() == 6 ? ParseId(parts[5]) : std::nullopt;
  if (parts[4] != "points" || !index) {
    return respond(HttpError(404, "there is no such path; points/INDEX of a chunk is one"));
  }
  GetPoint(*chunk, shape.owner, *index, respond);
}

void SessionApi::GetPoint(const Shape::Chunk& chunk, const std::string& owner, int64_t index,
                          Respond respond) {
  if (index >= static_cast<int64_t>(chunk.num_points)) {
    return respond(NoSuch("point " + std::to_string(index) + " in this chunk"));
  }
  if (chunk.tracks != nullptr) return AnswerPoint(chunk, *chunk.tracks, index, respond);
  FetchAll({chunk.tracks_blob}, owner, respond, [this, chunk, index, respond](const Blobs& blobs) {
    AnswerPoint(chunk, blobs.begin()->second, index, respond);
  });
}

void SessionApi::AnswerPoint(const Shape::Chunk& chunk, const Bytes& tracks_bytes, int64_t index,
                             Respond respond) {
  const Result<ShapeChunk> points = DecodeShapeChunk(*chunk.points);
  const Result<PointTracks> tracks = DecodePointTracks(tracks_bytes);
  if (!points.ok()) return AnswerError(respond, points.status());
  if (!tracks.ok()) return AnswerError(respond, tracks.status());
  const auto at = static_cast<size_t>(index);
  if (at >= points->points.size() || at >= tracks->ends.size()) {
    return respond(HttpError(500, "the chunk's parts do not fit together"));
  }
  json xyz = json::array();
  for (int i = 0; i < 3; ++i) {
    xyz.push_back(
        Rounded(points->origin[i] + points->step * points->points[at].xyz[i], kPointDigits));
  }
  const std::vector<PointObservation> seen(
      tracks->observations.begin() + (at == 0 ? 0 : tracks->ends[at - 1]),
      tracks->observations.begin() + tracks->ends[at]);
  std::map<uint32_t, std::string> keypoint_blobs;
  view_.With([&](const SessionRecord& session) {
    for (const PointObservation& observation : seen) {
      const PhotoState* photo = session.state.FindPhoto(observation.image_id);
      if (photo != nullptr && photo->features_seq > 0) {
        keypoint_blobs[observation.image_id] = photo->features.keypoints_blob;
      }
    }
    return true;
  });
  std::vector<std::string> wanted;
  for (const auto& [id, blob] : keypoint_blobs) wanted.push_back(blob);
  if (wanted.empty()) {
    return respond(JsonResponse(json({{"xyz", xyz}, {"photos", json::array()}}).dump()));
  }
  FetchAll(wanted, "ingest", respond, [=](const Blobs& blobs) {
    json photos = json::array();
    for (const PointObservation& observation : seen) {
      const auto blob = keypoint_blobs.find(observation.image_id);
      if (blob == keypoint_blobs.end()) continue;
      const Result<Keypoints> keypoints = DecodeKeypoints(blobs.at(blob->second));
      if (!keypoints.ok()) return AnswerError(respond, keypoints.status());
      if (observation.point2D_idx >= keypoints->size()) continue;
      const Keypoint& keypoint = (*keypoints)[observation.point2D_idx];
      photos.push_back({{"image", observation.image_id},
                        {"x", Rounded(keypoint.x, kPixelDigits)},
                        {"y", Rounded(keypoint.y, kPixelDigits)}});
    }
    respond(JsonResponse(json({{"xyz", xyz}, {"photos", std::move(photos)}}).dump()));
  });
}

void SessionApi::Photos(const Parts& parts, Respond respond) {
  const std::optional<int64_t> id = ParseId(parts[1]);
  if (!id) return respond(HttpError(400, "a photo is a number"));
  if (parts.size() == 2) return GetPhoto(*id, respond);
  if (parts.size() == 3 && parts[2] == "thumbnail") return GetThumbnail(*id, respond);
  if (parts.size() == 3 && parts[2] == "matches") return GetMatches(*id, respond);
  const std::optional<int64_t> other =
      parts.size() == 4 && parts[2] == "matches" ? ParseId(parts[3]) : std::nullopt;
  if (other) return GetMatch(*id, *other, respond);
  respond(HttpError(404, "there is no such path; /api/photos/ID/thumbnail is one"));
}

void SessionApi::GetPhoto(int64_t image_id, Respond respond) {
  const image_t image = view_.With([&](const SessionRecord& session) {
    const PhotoState* photo = session.state.FindPhoto(image_id);
    return photo == nullptr ? image_t() : photo->image;
  });
  if (image.blob_id.empty()) return respond(NoSuch("photo " + std::to_string(image_id)));
  HttpResponse response;
  response.content_type = ContentTypeOf(image.name);
  response.immutable = true;
  if (!source_.session_dir.empty()) {
    response.file = BlobStore(SessionPaths{source_.session_dir}.Blobs()).Path(image.blob_id);
    std::error_code error;
    if (fs::exists(response.file, error)) return respond(std::move(response));
    response.file.clear();
  }
  Fetch(image.blob_id, "ingest", [response, respond](Result<Bytes> bytes) mutable {
    if (!bytes.ok()) return AnswerError(respond, bytes.status());
    response.bytes = std::make_shared<const Bytes>(std::move(*bytes));
    respond(std::move(response));
  });
}

void SessionApi::GetThumbnail(int64_t image_id, Respond respond) {
  const auto answer = [respond](std::shared_ptr<const Bytes> jpeg) {
    HttpResponse response = BytesResponse(std::move(jpeg), "image/jpeg");
    response.immutable = true;
    respond(std::move(response));
  };
  if (const auto known = thumbnails_.Find(image_id)) return answer(known);
  const image_t image = view_.With([&](const SessionRecord& session) {
    const PhotoState* photo = session.state.FindPhoto(image_id);
    return photo == nullptr ? image_t() : photo->image;
  });
  if (image.blob_id.empty()) return respond(NoSuch("photo " + std::to_string(image_id)));
  FetchAll({image.blob_id}, "ingest", respond,
           [this, image_id, image, respond, answer](const Blobs& blobs) {
             decoding_.Run([=, photo = blobs.begin()->second] {
               Result<Bytes> jpeg =
                   thumbnail_maker_.Make(photo, image.orientation, kThumbnailSidePx);
               if (!jpeg.ok()) return AnswerError(respond, jpeg.status());
               const auto shared = std::make_shared<const Bytes>(std::move(*jpeg));
               thumbnails_.Add(image_id, shared);
               answer(shared);
             });
           });
}

void SessionApi::GetMatches(int64_t image_id, Respond respond) const {
  std::vector<std::pair<int32_t, int64_t>> matches;
  const bool known = view_.With([&](const SessionRecord& session) {
    for (const auto& edge : session.state.covisibility().EdgesOf(image_id)) {
      matches.push_back({edge.num_inliers, edge.other_id});
    }
    return session.state.FindPhoto(image_id) != nullptr;
  });
  if (!known) return respond(NoSuch("photo " + std::to_string(image_id)));
  std::sort(matches.rbegin(), matches.rend());
  json list = json::array();
  for (const auto& [inliers, other] : matches) {
    list.push_back({{"image", other}, {"inliers", inliers}});
  }
  respond(JsonResponse(list.dump()));
}

// The pair stands in the matches of one of the two.
void SessionApi::GetMatch(int64_t image_id, int64_t other_id, Respond respond) {
  struct Found {
    std::vector<std::string> pair_blobs;
    std::string keypoints, other_keypoints;
    bool matched = false;
  };
  const Found found = view_.With([&](const SessionRecord& session) {
    Found blobs;
    const PhotoState* photo = session.state.FindPhoto(image_id);
    const PhotoState* other = session.state.FindPhoto(other_id);
    if (photo == nullptr || other == nullptr) return blobs;
    for (const auto& edge : session.state.covisibility().EdgesOf(image_id)) {
      blobs.matched |= edge.other_id == other_id;
    }
    for (const PhotoState* side : {photo, other}) {
      if (!side->pairs_blob.empty()) blobs.pair_blobs.push_back(side->pairs_blob);
    }
    blobs.keypoints = photo->features.keypoints_blob;
    blobs.other_keypoints = other->features.keypoints_blob;
    return blobs;
  });
  if (!found.matched) {
    return respond(NoSuch("verified pair of photos " + std::to_string(image_id) + " and " +
                          std::to_string(other_id)));
  }
  std::vector<std::string> wanted = found.pair_blobs;
  wanted.push_back(found.keypoints);
  wanted.push_back(found.other_keypoints);
  FetchAll(wanted, "ingest", respond, [=](const Blobs& blobs) {
    const Result<Keypoints> mine = DecodeKeypoints(blobs.at(found.keypoints));
    const Result<Keypoints> others = DecodeKeypoints(blobs.at(found.other_keypoints));
    if (!mine.ok()) return AnswerError(respond, mine.status());
    if (!others.ok()) return AnswerError(respond, others.status());
    json points = json::array();
    for (const std::string& blob : found.pair_blobs) {
      const Result<TwoViewPairs> pairs = DecodeTwoViewPairs(blobs.at(blob));
      if (!pairs.ok()) return AnswerError(respond, pairs.status());
      for (const TwoViewPair& pair : *pairs) {
        const bool of_mine = pair.other_id == other_id;
        if (!of_mine && pair.other_id != image_id) continue;
        for (const auto& [index, other_index] : pair.inliers) {
          const uint32_t a = of_mine ? index : other_index, b = of_mine ? other_index : index;
          if (a >= mine->size() || b >= others->size()) continue;
          json point = PointJson((*mine)[a]);
          for (const json& value : PointJson((*others)[b])) point.push_back(value);
          points.push_back(std::move(point));
        }
      }
      if (!points.empty()) break;  // told by both
    }
    respond(JsonResponse(json({{"points", std::move(points)}}).dump()));
  });
}

void SessionApi::Download(const Parts& parts, Respond respond) {
  static const std::map<std::string, std::string> formats = {
      {"model.zip", "bin"}, {"points.ply", "ply"}, {"nerfstudio.zip", "nerfstudio"}};
  const auto format = parts.size() == 1 ? formats.find(parts.front()) : formats.end();
  if (format == formats.end()) {
    return respond(HttpError(404, "there are model.zip, points.ply and nerfstudio.zip"));
  }
  const std::vector<submap_model_t> models =
      view_.With([](const SessionRecord& session) { return LatestModels(session.state); });
  if (models.empty()) return respond(HttpError(404, "the session has no model yet"));
  if (downloading_.exchange(true)) {
    return respond(HttpError(503, "another download is being made: try again in a minute"));
  }
  const auto slot = std::make_shared<DownloadSlot>(&downloading_);
  respond = [slot, answer = std::move(respond)](HttpResponse response) {
    slot->Free();
    answer(std::move(response));
  };
  std::vector<std::string> wanted;
  for (const submap_model_t& model : models) wanted.push_back(model.model_blob);
  if (format->second == "ply") wanted.resize(1);  // the largest model
  FetchAll(wanted, "ingest", respond, [models, format, respond](const Blobs& blobs) {
    std::vector<ExportModel> read;
    for (const submap_model_t& model : models) {
      const auto archive = blobs.find(model.model_blob);
      if (archive == blobs.end()) continue;
      Result<ExportModel> one = ReadModelArchive(model, archive->second);
      if (!one.ok()) return AnswerError(respond, one.status());
      read.push_back(std::move(*one));
    }
    HttpResponse response;
    response.download_name = format->first;
    response.content_type = ContentTypeOf(format->first);
    auto folder = std::make_shared<const TemporaryFolder>();
    response.file = folder->path() / format->first;
    const Status made = format->second == "ply"
                            ? WriteModel(*read.front().reconstruction, "ply", folder->path())
                            : WriteModelsZip(read, format->second, response.file);
    if (!made.ok()) return AnswerError(respond, made);
    response.keep = std::move(folder);
    respond(std::move(response));
  });
}

}  // namespace skein
