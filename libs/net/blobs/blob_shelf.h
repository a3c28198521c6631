// Blobs in memory: those a process offers, and a cache of those it fetched.
#pragma once

#include <cstddef>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "core/bytes.h"
#include "core/clock.h"

namespace skein {

using BlobPtr = std::shared_ptr<const Bytes>;

// Any thread.
class BlobShelf {
 public:
  // The cache forgets what was used longest ago beyond this many bytes.
  explicit BlobShelf(size_t cache_bytes, Clock clock = MonotonicS)
      : cache_bytes_(cache_bytes), clock_(std::move(clock)) {}

  // Keeps the blob until as many calls of Release.
  void Hold(const std::string& blob_id, BlobPtr blob);
  void Release(const std::string& blob_id);
  static constexpr size_t kMaxServedBytes = 64 << 20;

  // Keeps the blob until ttl_s after its last use; the one that would expire first goes earlier
  // where they have more than kMaxServedBytes together. The latest stays.
  void HoldFor(const std::string& blob_id, BlobPtr blob, double ttl_s);
  void DropExpired();

  void Cache(const std::string& blob_id, BlobPtr blob);
  // Null if it is not here.
  BlobPtr Find(const std::string& blob_id);

  size_t cached_bytes() const;
  size_t num_held() const;

 private:
  struct Held {
    BlobPtr blob;
    int num_holders = 0;
    double ttl_s = 0;
    double expires_s = 0;
  };
  struct Cached {
    std::string blob_id;
    BlobPtr blob;
  };

  void LimitServed(const std::string& latest);
  void EraseIfUnused(std::map<std::string, Held>::iterator held, double now_s);

  const size_t cache_bytes_;
  const Clock clock_;
  mutable std::mutex mutex_;
  std::map<std::string, Held> held_;
  std::list<Cached> recent_;  // most recent first
  std::map<std::string, std::list<Cached>::iterator> cached_;
  size_t used_bytes_ = 0;
};

}  // namespace skein
