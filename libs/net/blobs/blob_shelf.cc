#include "blobs/blob_shelf.h"

#include <algorithm>
#include <utility>

namespace skein {

void BlobShelf::Hold(const std::string& blob_id, BlobPtr blob) {
  const std::lock_guard<std::mutex> lock(mutex_);
  Held& held = held_[blob_id];
  held.blob = std::move(blob);
  ++held.num_holders;
}

void BlobShelf::Release(const std::string& blob_id) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto held = held_.find(blob_id);
  if (held == held_.end()) return;
  held->second.num_holders = std::max(0, held->second.num_holders - 1);
  EraseIfUnused(held, clock_());
}

void BlobShelf::HoldFor(const std::string& blob_id, BlobPtr blob, double ttl_s) {
  const std::lock_guard<std::mutex> lock(mutex_);
  Held& held = held_[blob_id];
  held.blob = std::move(blob);
  held.ttl_s = ttl_s;
  held.expires_s = clock_() + ttl_s;
  LimitServed(blob_id);
}

void BlobShelf::LimitServed(const std::string& latest) {
  while (true) {
    size_t served_bytes = 0;
    auto first = held_.end();
    for (auto held = held_.begin(); held != held_.end(); ++held) {
      if (held->second.num_holders > 0) continue;
      served_bytes += held->second.blob->size();
      const bool expires_first =
          first == held_.end() || held->second.expires_s < first->second.expires_s;
      if (held->first != latest && expires_first) first = held;
    }
    if (served_bytes <= kMaxServedBytes || first == held_.end()) return;
    held_.erase(first);
  }
}

void BlobShelf::DropExpired() {
  const std::lock_guard<std::mutex> lock(mutex_);
  const double now_s = clock_();
  for (auto held = held_.begin(); held != held_.end();) EraseIfUnused(held++, now_s);
}

void BlobShelf::EraseIfUnused(std::map<std::string, Held>::iterator held, double now_s) {
  if (held->second.num_holders == 0 && held->second.expires_s <= now_s) held_.erase(held);
}

void BlobShelf::Cache(const std::string& blob_id, BlobPtr blob) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (blob->size() > cache_bytes_ || cached_.count(blob_id)) return;
  used_bytes_ += blob->size();
  recent_.push_front({blob_id, std::move(blob)});
  cached_[blob_id] = recent_.begin();
  while (used_bytes_ > cache_bytes_) {
    used_bytes_ -= recent_.back().blob->size();
    cached_.erase(recent_.back().blob_id);
    recent_.pop_back();
  }
}

BlobPtr BlobShelf::Find(const std::string& blob_id) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (const auto held = held_.find(blob_id); held != held_.end()) {
    held->second.expires_s = clock_() + held->second.ttl_s;
    return held->second.blob;
  }
  const auto cached = cached_.find(blob_id);
  if (cached == cached_.end()) return nullptr;
  recent_.splice(recent_.begin(), recent_, cached->second);
  return recent_.front().blob;
}

size_t BlobShelf::cached_bytes() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return used_bytes_;
}

size_t BlobShelf::num_held() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return held_.size();
}

}  // namespace skein
