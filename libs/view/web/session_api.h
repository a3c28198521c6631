// Answers of the live view's server: paths to JSON, chunks, photos, models. All paths are listed in
// services/web/README.md.
#pragma once

#include <cstdint>
#include <string>

#include "http/http.h"
#include "http/job_pool.h"
#include "http/static_files.h"
#include "shapes/shape_store.h"
#include "web/api_answers.h"
#include "web/blob_fetcher.h"
#include "web/downloads.h"
#include "web/photos_api.h"
#include "web/session_source.h"
#include "web/session_view.h"
#include "web/submaps_api.h"

namespace skein {

// Points that a page should show at most: what an integrated GPU draws fluently.
constexpr int64_t kPagePoints = 10'000'000;

class SessionApi {
 public:
  // `view` outlives this. At most `num_threads` jobs run at a time; jobs that the disk holds up do
  // not count.
  SessionApi(const SessionView& view, SessionSource source, int num_threads);

  ShapeStore& shapes() { return submaps_.shapes(); }
  DenseStore& dense() { return submaps_.dense(); }

  // For a WebServer.
  void Handle(const HttpRequest& request, Respond respond);
  // "" if there is no such photo.
  std::string AgentOfPhoto(int64_t image_id) const;

 private:
  void HandleApi(const PathParts& parts, const HttpRequest& request, Respond respond);
  void GetSession(const HttpRequest& request, Respond respond) const;
  void GetEvents(const HttpRequest& request, Respond respond) const;
  void GetReport(Respond respond);
  void GetMetrics(const Respond& respond);
  void Invite(const HttpRequest& request, Respond respond);
  void AskToFinish(const HttpRequest& request, const Respond& respond);

  const SessionView& view_;
  const SessionSource source_;
  const StaticFiles page_;
  BlobFetcher blobs_;
  SubmapsApi submaps_;
  PhotosApi photos_;
  Downloads downloads_;
  JobPool pool_;  // last: its jobs use the rest
};

}  // namespace skein
