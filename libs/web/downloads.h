// /download: the newest models as files. One is made at a time.
#pragma once

#include <atomic>

#include "web/api_answers.h"
#include "web/blob_fetcher.h"
#include "web/http.h"
#include "web/session_view.h"

namespace skein {

// Any thread.
class Downloads {
 public:
  // Both outlive this, and answers to Handle.
  Downloads(const SessionView& view, BlobFetcher& blobs);

  // `parts`: {"model.zip"}.
  void Handle(const PathParts& parts, Respond respond);

 private:
  const SessionView& view_;
  BlobFetcher& blobs_;
  std::atomic<bool> is_making_{false};
};

}  // namespace skein
