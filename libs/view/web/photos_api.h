// /api/photos: photos as stored, thumbnails, and verified matches.
#pragma once

#include <cstdint>

#include "http/http.h"
#include "http/job_pool.h"
#include "web/api_answers.h"
#include "web/blob_fetcher.h"
#include "web/session_source.h"
#include "web/session_view.h"
#include "web/thumbnails.h"

namespace skein {

constexpr int kThumbnailSidePx = 320;

// Any thread.
class PhotosApi {
 public:
  // All outlive this, but the pool: that one ends before.
  PhotosApi(const SessionView& view, const SessionSource& source, BlobFetcher& blobs,
            JobPool& pool);

  // `parts`: {"photos", ID, ...}.
  void Handle(const PathParts& parts, const HttpRequest& request, Respond respond);

 private:
  image_t ImageOf(int64_t image_id) const;  // without a blob where there is no such photo
  void GetPhoto(int64_t image_id, const HttpRequest& request, Respond respond);
  void GetThumbnail(int64_t image_id, const HttpRequest& request, Respond respond);
  void GetMatches(int64_t image_id, Respond respond) const;
  void GetMatch(int64_t image_id, int64_t other_id, Respond respond);

  const SessionView& view_;
  const SessionSource& source_;
  BlobFetcher& blobs_;
  JobPool& pool_;
  ThumbnailCache thumbnails_;
  ThumbnailMaker thumbnail_maker_;  // of decoding_'s thread
  JobPool decoding_{1};             // last: its jobs use the rest
};

}  // namespace skein
