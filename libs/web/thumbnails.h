#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <utility>

#include "core/bytes.h"

namespace skein {

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
