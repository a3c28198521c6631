#include "web/session_api.h"

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "core/clock.h"
#include "core/file_below.h"
#include "core/version.h"
#include "invite/qr_code.h"
#include "ledger/session_folder.h"
#include "transport/invitation.h"
#include "web/metrics.h"

namespace skein {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

// For those jobs that the disk holds up: no more than connections, each of which has one request.
constexpr int kMoreThreads = 254;
constexpr double kMaxWithinS = 86'400;

PathParts SplitPath(const std::string& path) {
  PathParts parts;
  size_t begin = 1;
  while (begin <= path.size()) {
    const size_t end = std::min(path.find('/', begin), path.size());
    parts.push_back(path.substr(begin, end - begin));
    begin = end + 1;
  }
  return parts;
}

// A phone installs it, and tells by its ending what it is.
void GetCertificate(const PublicAddresses& addresses, const Respond& respond) {
  if (addresses.certificate_der.empty()) return respond(NoSuch("certificate"));
  HttpResponse response = BytesResponse(std::make_shared<const Bytes>(addresses.certificate_der),
                                        "application/x-x509-ca-cert");
  response.download_name = "skein.crt";
  respond(std::move(response));
}

// nullopt where the file system does not tell it. May block.
std::optional<DiskSpace> DiskSpaceOf(const fs::path& folder) {
  if (folder.empty()) return std::nullopt;
  std::error_code error;
  const fs::space_info space = fs::space(folder, error);
  if (error) return std::nullopt;
  return DiskSpace{static_cast<int64_t>(space.available), static_cast<int64_t>(space.capacity)};
}

}  // namespace

SessionApi::SessionApi(const SessionView& view, SessionSource source, int num_threads)
    : view_(view),
      source_(std::move(source)),
      page_(source_.page_dir),
      blobs_(source_.fetch, pool_),
      submaps_(view_, source_, blobs_),
      photos_(view_, source_, blobs_, pool_),
      downloads_(view_, blobs_),
      pool_(num_threads, kMoreThreads) {}

void SessionApi::Handle(const HttpRequest& request, Respond respond) {
  PathParts parts = SplitPath(request.path);
  const std::string first = parts.empty() ? "" : parts.front();
  if (first != "api" && first != "download") {
    if (request.path == "/skein.crt") return GetCertificate(source_.addresses, respond);
    if (request.path == "/metrics") return GetMetrics(respond);
    pool_.Run([this, path = request.path, takes_gzip = request.takes_gzip, respond] {
      respond(page_.Get(path, takes_gzip));
    });
    return;
  }
  parts.erase(parts.begin());
  first == "api" ? HandleApi(parts, request, respond) : downloads_.Handle(parts, request, respond);
}

void SessionApi::HandleApi(const PathParts& parts, const HttpRequest& request, Respond respond) {
  const std::string what = parts.empty() ? "" : parts.front();
  const bool alone = parts.size() == 1;
  if (what == "session" && alone) return GetSession(request, respond);
  if (what == "uploads" && parts.size() == 2) {
    if (!source_.uploads) return respond(HttpError(404, "nothing is uploaded here"));
    return source_.uploads(parts[1], request, std::move(respond));
  }
  if (what == "invitations" && alone) return Invite(request, respond);
  if (what == "finish" && alone) return AskToFinish(request, respond);
  if (what == "events" && alone) return GetEvents(request, respond);
  if (what == "report" && alone) return GetReport(respond);
  if (what == "submaps" && parts.size() >= 2) return submaps_.Handle(parts, request, respond);
  if (what == "photos" && parts.size() >= 2) return photos_.Handle(parts, request, respond);
  respond(HttpError(404, "there is no such path; /api/session is one"));
}

void SessionApi::GetSession(const HttpRequest& request, Respond respond) const {
  const std::string folder =
      source_.session_dir.empty() ? "" : fs::absolute(source_.session_dir).filename().string();
  json answer = {{"session_id", source_.session_id},
                 {"folder", folder},
                 {"live", source_.live},
                 {"version", Version()},
                 {"head", view_.events().head()},
                 {"page_limits", {{"points", kPagePoints}}},
                 {"visitor", nullptr},
                 {"invites", source_.invite != nullptr},
                 {"finishes", source_.finish && request.visitor.role == Role::kOperator}};
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

std::string SessionApi::AgentOfPhoto(int64_t image_id) const {
  return view_.With([&](const SessionRecord& session) {
    const PhotoState* photo = session.state.FindPhoto(image_id);
    return photo == nullptr ? std::string() : photo->image.agent;
  });
}

void SessionApi::Invite(const HttpRequest& request, Respond respond) {
  if (!source_.invite) {
    return respond(HttpError(404,
                             "nobody is let in from elsewhere: start the session with "
                             "`skein launch --web-public HOST`"));
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

// {"within_s": S}, or nothing: as long as it takes.
void SessionApi::AskToFinish(const HttpRequest& request, const Respond& respond) {
  if (!source_.finish) return respond(HttpError(404, "the session is not finished from here"));
  const json asked =
      request.body.empty() ? json::object() : json::parse(request.body, nullptr, false);
  const json within = asked.is_object() ? asked.value("within_s", json(0)) : json();
  const double within_s = within.is_number() ? within.get<double>() : -1;
  if (!(within_s >= 0 && within_s <= kMaxWithinS)) {
    return respond(HttpError(
        400, "within_s: give seconds, at most " + std::to_string(static_cast<int>(kMaxWithinS))));
  }
  source_.finish(within_s, [respond](const Status& status) {
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

void SessionApi::GetReport(Respond respond) {
  if (source_.session_dir.empty()) {
    return respond(HttpError(404, "report.json is in the session folder, on its host"));
  }
  pool_.Run([paths = SessionPaths{source_.session_dir}, respond = std::move(respond)] {
    HttpResponse response;
    response.file_root = paths.root;
    response.file = paths.Report();
    if (!IsFileBelow(response.file_root, response.file)) {
      return respond(HttpError(404, "there is no report before the first `skein finish`"));
    }
    respond(std::move(response));
  });
}

// Counters that begin anew while the ledger is read would be told as if all of it happened again.
void SessionApi::GetMetrics(const Respond& respond) {
  if (source_.has_read_ledger && !source_.has_read_ledger()) {
    return respond(HttpError(503, "the ledger is not read yet: try again"));
  }
  pool_.Run([this, respond] {
    const HeardProcesses processes = source_.processes ? source_.processes() : HeardProcesses{};
    std::optional<int64_t> num_troubles;
    if (source_.troubles) num_troubles = static_cast<int64_t>(source_.troubles().size());
    const std::optional<DiskSpace> disk = DiskSpaceOf(source_.session_dir);
    HttpResponse response;
    response.content_type = "text/plain; version=0.0.4; charset=utf-8";
    response.text = view_.WithTally([&](const SessionRecord& session, const SessionTally& tally) {
      return MetricsText(
          {source_.session_id, session, tally, processes, NowUs(), num_troubles, disk});
    });
    respond(std::move(response));
  });
}

}  // namespace skein
