#include "web/downloads.h"

#include <iterator>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "export/georeferenced.h"
#include "export/model_writer.h"
#include "export/models_zip.h"
#include "export/session_models.h"
#include "export/temporary_folder.h"
#include "session/read_session.h"

namespace skein {
namespace {

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

// Three formats, with the place on earth and without it, and two of models that are older by now.
constexpr size_t kMostFiles = 8;

std::string ContentOf(const std::string& name, bool georeferenced,
                      const std::vector<std::string>& blobs) {
  std::string content = name + (georeferenced ? " georeferenced" : "");
  for (const std::string& blob : blobs) content += " " + blob;
  return content;
}

using Positions = decltype(PositionsOf(SessionState()));

// Error, the reasons: none can be placed.
Status Place(const Positions& positions, std::vector<ExportModel>* models) {
  std::vector<std::string> refusals;
  PlaceOnEarth(positions, models, &refusals);
  if (!models->empty()) return Status::Ok();
  std::string reasons;
  for (const std::string& refusal : refusals) reasons += (reasons.empty() ? "" : "; ") + refusal;
  return NotFound("no model can be georeferenced: " + reasons);
}

}  // namespace

Downloads::Downloads(const SessionView& view, BlobFetcher& blobs) : view_(view), blobs_(blobs) {}

HttpResponse Downloads::Answer(const std::string& name, FolderPtr folder) {
  HttpResponse response;
  response.download_name = name;
  response.content_type = ContentTypeOf(name);
  response.file_root = folder->path();
  response.file = folder->path() / name;
  response.keep = std::move(folder);
  return response;
}

Downloads::FolderPtr Downloads::Find(const std::string& content) {
  for (auto sent = sent_.begin(); sent != sent_.end();) {
    sent = sent->second.expired() ? sent_.erase(sent) : std::next(sent);
  }
  const auto found = sent_.find(content);
  return found == sent_.end() ? nullptr : found->second.lock();
}

void Downloads::Handle(const PathParts& parts, const HttpRequest& request, Respond respond) {
  static const std::map<std::string, std::string> formats = {
      {"model.zip", "bin"}, {"points.ply", "ply"}, {"nerfstudio.zip", "nerfstudio"}};
  const auto format = parts.size() == 1 ? formats.find(parts.front()) : formats.end();
  if (format == formats.end()) {
    return respond(HttpError(404, "there are model.zip, points.ply and nerfstudio.zip"));
  }
  const std::vector<submap_model_t> models =
      view_.With([](const SessionRecord& session) { return LatestModels(session.state); });
  if (models.empty()) return respond(HttpError(404, "the session has no model yet"));
  if (is_making_.exchange(true)) {
    return respond(HttpError(503, "another download is being made: try again in a minute"));
  }
  const auto slot = std::make_shared<DownloadSlot>(&is_making_);
  respond = [slot, answer = std::move(respond)](HttpResponse response) {
    slot->Free();
    answer(std::move(response));
  };
  std::vector<std::string> wanted;
  for (const submap_model_t& model : models) wanted.push_back(model.model_blob);
  const bool georeferenced = request.query.count("georeferenced") > 0;
  // The largest model, or of those that can be placed.
  if (format->second == "ply" && !georeferenced) wanted.resize(1);
  const std::string content = ContentOf(format->first, georeferenced, wanted);
  if (FolderPtr sent = Find(content)) return respond(Answer(format->first, std::move(sent)));
  if (sent_.size() >= kMostFiles) {
    return respond(HttpError(503, "too many downloads are being sent: try again in a minute"));
  }
  Positions positions;
  if (georeferenced) {
    positions = view_.With([](const SessionRecord& session) { return PositionsOf(session.state); });
  }
  blobs_.FetchAll(wanted, "ingest", respond,
                  [this, models, format, georeferenced, positions, content,
                   respond](const BlobFetcher::Blobs& blobs) {
                    std::vector<ExportModel> read;
                    for (const submap_model_t& model : models) {
                      const auto archive = blobs.find(model.model_blob);
                      if (archive == blobs.end()) continue;
                      Result<ExportModel> one = ReadModelArchive(model, archive->second);
                      if (!one.ok()) return AnswerError(respond, one.status());
                      read.push_back(std::move(*one));
                    }
                    if (georeferenced) {
                      if (Status placed = Place(positions, &read); !placed.ok()) {
                        return AnswerError(respond, placed);
                      }
                    }
                    FolderPtr folder = std::make_shared<const TemporaryFolder>();
                    const Status made =
                        format->second == "ply"
                            ? WriteModel(*read.front().reconstruction, "ply", folder->path())
                            : WriteModelsZip(read, format->second, folder->path() / format->first);
                    if (!made.ok()) return AnswerError(respond, made);
                    sent_[content] = folder;
                    respond(Answer(format->first, std::move(folder)));
                  });
}

}  // namespace skein
