#include "web/uploads_api.h"

#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>
#include <utility>

#include "core/hash.h"
#include "ledger/fact_ids.h"
#include "session/guidance_json.h"
#include "session/state_names.h"
#include "web/diagnosis_json.h"
#include "web/upload_sink.h"

namespace skein {
namespace {

using nlohmann::json;

constexpr size_t kMaxStates = 500;
constexpr std::string_view kUploadsPath = "/api/uploads/";

json Refused(int8_t cause, const std::string& reason) {
  return {{"state", "refused"}, {"cause", FailureCauseName(cause)}, {"reason", reason}};
}

// What the ledger says of a photo that an agent sent; null: nothing.
json LedgerState(const SessionRecord& session, const std::string& agent, const std::string& name,
                 const std::string& blob_id) {
  const PhotoState* photo = session.state.FindPhoto(session.history.FindImageByBlob(blob_id));
  if (photo == nullptr) {
    const failure_t* refused =
        session.history.FindFailure(RefusedOfferFactId(agent, name, blob_id));
    if (refused == nullptr) return nullptr;
    return Refused(refused->cause, refused->reason);
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
  state.update(DiagnosisJson(session.state, *photo, diagnosis));
  state["state"] = has_failed ? "failed" : "unplaced";
  return state;
}

HttpResponse StillReading() { return HttpError(503, "the session is still being read: wait"); }

}  // namespace

UploadsApi::UploadsApi(const SessionView& view, UploadStore& store, JobPool& jobs, UploadNews news)
    : view_(view), store_(store), jobs_(jobs), news_(std::move(news)) {}

std::shared_ptr<BodySink> UploadsApi::MakeSink(const HttpRequest& request) {
  if (request.path.compare(0, kUploadsPath.size(), kUploadsPath) != 0) return nullptr;
  const std::string blob_id = request.path.substr(kUploadsPath.size());
  if (blob_id.find('/') != std::string::npos) return nullptr;
  return MakeUploadSink(store_, jobs_, request, blob_id);
}

void UploadsApi::Handle(const std::string& name, const HttpRequest& request, Respond respond) {
  if (request.method == "POST" && name == "states") {
    return jobs_.Run([this, request, respond] { GetStates(request, respond); });
  }
  if (request.method != "HEAD") return respond(HttpError(404, "there is no such path"));
  jobs_.Run([this, agent = request.visitor.name, name, respond] { Head(agent, name, respond); });
}

// Uploads are looked at before the ledger: a photo leaves them once it is there.
void UploadsApi::Head(const std::string& agent, const std::string& blob_id,
                      const Respond& respond) const {
  if (!IsBlobId(blob_id)) {
    return respond(
        HttpError(400, "name the photo by its SHA-256, 64 lower-case hexadecimal digits"));
  }
  const bool has_read_ledger = HasReadLedger();
  const std::optional<UploadStore::Progress> here = store_.Look(agent, blob_id);
  const bool is_in_ledger = view_.With(
      [&](const SessionRecord& session) { return session.history.FindImageByBlob(blob_id) != 0; });
  if (!here && !is_in_ledger && !has_read_ledger) return respond(StillReading());
  respond(UploadHead(here, is_in_ledger));
}

// {"photos": [[SHA256, name], ...]} -> {"states": [...], in the same order, "advice": AdviceJson or
// null, "troubles": TroublesJson}.
void UploadsApi::GetStates(const HttpRequest& request, const Respond& respond) const {
  const json asked = json::parse(request.body, nullptr, false);
  if (!asked.is_object() || !asked.contains("photos") || !asked["photos"].is_array() ||
      asked["photos"].size() > kMaxStates) {
    return respond(HttpError(
        400, "give {\"photos\": [[SHA256, name], ...]}, at most " + std::to_string(kMaxStates)));
  }
  const std::string& agent = request.visitor.name;
  const bool has_read_ledger = HasReadLedger();
  const std::map<std::string, UploadStore::Refusal> refusals = store_.Refusals(agent);
  const std::map<std::string, UploadStore::Progress> here = store_.ProgressOf(agent);
  const std::string wait_reason = store_.WaitReason(agent);
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
    const auto refused = refusals.find(blob_id);
    if (state.is_null() && refused != refusals.end()) {
      state = Refused(refused->second.cause, refused->second.reason);
    }
    if (state.is_null() && !has_read_ledger) return respond(StillReading());
    states.push_back(state.is_null() ? json({{"state", "unknown"}}) : std::move(state));
  }
  const std::optional<advice_t> advice = news_.advice ? news_.advice(agent) : std::nullopt;
  const json next = advice ? AdviceJson(*advice) : json(nullptr);
  const json troubles = news_.troubles ? TroublesJson(news_.troubles()) : json::array();
  respond(
      JsonResponse(json({{"states", std::move(states)}, {"advice", next}, {"troubles", troubles}})
                       .dump(-1, ' ', false, json::error_handler_t::replace)));
}

}  // namespace skein
