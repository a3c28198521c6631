// /download: the newest models as files. The server makes one download at a time; a request
// meanwhile is answered with 503.
#pragma once

#include <atomic>

#include "http/http.h"
#include "web/api_answers.h"
#include "web/blob_fetcher.h"
#include "web/session_view.h"

namespace skein {

// Any thread.
class Downloads {
 public:
  // Both outlive this, and answers to Handle.
  Downloads(const SessionView& view, BlobFetcher& blobs);

  // `parts`: {"model.zip"}. The query "georeferenced" moves the models into metres east, north and
  // up by their photos' GPS, as `skein export --georeferenced`; 404 with the reason if none can be.
  void Handle(const PathParts& parts, const HttpRequest& request, Respond respond);

 private:
  const SessionView& view_;
  BlobFetcher& blobs_;
  std::atomic<bool> is_making_{false};
};

}  // namespace skein
