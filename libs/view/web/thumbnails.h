#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <utility>

#include "core/bytes.h"
#include "core/result.h"
#include "photo/photo_decoder.h"

namespace skein {

// Decodes photos in a confined child (photo/photo_decoder.h). Used by one thread, which outlives it
// or ends with it.
class ThumbnailMaker {
 public:
  // A JPEG of the upright view, at most `max_side_px` on its longest side. `exif_orientation` 1..8.
  Result<Bytes> Make(const Bytes& photo, int exif_orientation, int max_side_px);

 private:
  std::unique_ptr<PhotoDecoder> decoder_;  // null before the first
};

// Thumbnails by photo, at most kMaxBytes of them: those that were asked for last. Any thread.
class ThumbnailCache {
 public:
  static constexpr size_t kMaxBytes = 64 << 20;

  explicit ThumbnailCache(size_t max_bytes = kMaxBytes) : max_bytes_(max_bytes) {}

  std::shared_ptr<const Bytes> Find(int64_t image_id);
  void Add(int64_t image_id, std::shared_ptr<const Bytes> jpeg);
  size_t size_bytes() const;

 private:
  using Entry = std::pair<int64_t, std::shared_ptr<const Bytes>>;

  const size_t max_bytes_;
  mutable std::mutex mutex_;
  std::list<Entry> recent_;  // most recent first
  std::map<int64_t, std::list<Entry>::iterator> places_;
  size_t used_bytes_ = 0;
};

}  // namespace skein
