// What the live view's server answers: paths to JSON, chunks, photos, models. All paths are listed
// in services/web/README.md.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "auth/certificate.h"
#include "core/result.h"
#include "shapes/shape_store.h"
#include "web/http.h"
#include "web/job_pool.h"
#include "web/session_view.h"
#include "web/static_files.h"
#include "web/thumbnails.h"
#include "web/upload_store.h"

namespace skein {

// Points that a page should show at most: what an integrated GPU draws fluently.
constexpr int64_t kPagePoints = 4'000'000;
constexpr int kThumbnailSidePx = 320;

// A browser is let in by any of these links.
struct WebInvitation {
  std::string name;
  std::string secure_link;  // https
  std::string plain_link;   // http; "": there is no such port
};

// How others than this host reach the server. Empty where they do not.
struct PublicAddresses {
  std::string secure;       // "https://10.77.0.1:8471"
  std::string plain;        // "http://10.77.0.1:8472"
  std::string fingerprint;  // of the certificate that a phone may install
  Bytes certificate_der;
};

// Where the API's answers come from. The functions are called on the API's threads and the
// server's.
struct SessionSource {
  std::string session_id;
  bool live = false;
  std::filesystem::path session_dir;  // "": this process does not share the session folder
  std::filesystem::path page_dir;

  // Gives a blob of a fact, or of a mapper's shape, within the call or later on any thread. Always
  // ends. May block.
  using Done = std::function<void(Result<Bytes>)>;
  std::function<void(const std::string& blob_id, const std::string& owner, Done done)> fetch;
  // Whether a submap without a shape may be shown by its newest model: not while its mapper is
  // about to tell its shape.
  std::function<bool(int64_t submap_id)> may_use_model;
  // Somebody asks for shapes.
  std::function<void()> on_look;

  PublicAddresses addresses;
  UploadStore* uploads = nullptr;  // null: nothing is uploaded
  // Null: nobody is invited here. May block.
  std::function<Result<WebInvitation>(Role role, const std::string& name)> invite;
  // Asks ingest to finish the session; null: it is not asked from here. Answers once it has begun.
  std::function<void(std::function<void(Status)> done)> finish;
};

class SessionApi {
 public:
  // `view` outlives this.
  SessionApi(const SessionView& view, SessionSource source, int num_threads);

  ShapeStore& shapes() { return shapes_; }

  // For a WebServer.
  void Handle(const HttpRequest& request, Respond respond);
  std::shared_ptr<BodySink> MakeSink(const HttpRequest& request);
  // "" if there is no such photo.
  std::string AgentOfPhoto(int64_t image_id) const;

  // The message that tells all pages the version of a shape.
  static std::string ShapeMessage(int64_t submap_id, uint64_t version);
  static std::string GoneMessage(int64_t submap_id);

 private:
  // The parts of a path behind the first, e.g. {"photos", "3", "thumbnail"}.
  using Parts = std::vector<std::string>;
  using Blobs = std::map<std::string, Bytes>;

  void HandleApi(const Parts& parts, const HttpRequest& request, Respond respond);
  void Submaps(const Parts& parts, const HttpRequest& request, Respond respond);
  void Photos(const Parts& parts, Respond respond);
  void Uploads(const Parts& parts, const HttpRequest& request, Respond respond);
  void GetUploadStates(const HttpRequest& request, const Respond& respond) const;
  void Invite(const HttpRequest& request, Respond respond);
  void AskToFinish(const Respond& respond);
  void GetSession(const HttpRequest& request, Respond respond) const;
  void GetEvents(const HttpRequest& request, Respond respond) const;
  void GetReport(Respond respond) const;
  void WithShape(int64_t submap_id, const Respond& respond, std::function<void(ShapePtr)> then);
  void GetChunk(const Shape& shape, const Parts& parts, const HttpRequest& request,
                Respond respond);
  void GetPoint(const Shape::Chunk& chunk, const std::string& owner, int64_t index,
                Respond respond);
  void AnswerPoint(const Shape::Chunk& chunk, const Bytes& tracks, int64_t index, Respond respond);
  void GetPhoto(int64_t image_id, Respond respond);
  void GetThumbnail(int64_t image_id, Respond respond);
  void GetMatches(int64_t image_id, Respond respond) const;
  void GetMatch(int64_t image_id, int64_t other_id, Respond respond);
  void Download(const Parts& parts, Respond respond);

  // Never on the server's thread, so it may block.
  void Fetch(const std::string& blob_id, const std::string& owner, SessionSource::Done done);
  // Calls `then` with all of these blobs on a thread of the pool, or answers with what is wrong.
  void FetchAll(const std::vector<std::string>& blob_ids, const std::string& owner,
                const Respond& respond, std::function<void(const Blobs&)> then);

  const SessionView& view_;
  const SessionSource source_;
  const StaticFiles page_;
  ShapeStore shapes_;
  ThumbnailCache thumbnails_;
  std::atomic<bool> downloading_{false};
  ThumbnailMaker thumbnail_maker_;  // of decoding_'s thread
  // Last: their jobs use the rest.
  JobPool decoding_{1};
  JobPool uploading_{2};
  JobPool pool_;
};

}  // namespace skein
