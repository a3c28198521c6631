#pragma once

// Features of recently used photos, bounded in bytes. One thread.

#include <cstdint>
#include <list>
#include <unordered_map>

#include "matching/photo_features.h"

namespace skein {

class FeatureCache {
 public:
  explicit FeatureCache(size_t max_bytes) : max_bytes_(max_bytes) {}

  // Null if it is not here. Counts as a use.
  PhotoFeaturesPtr Find(int64_t image_id);

  // Drops the least recently used photos until the rest fits. Photos handed out live as long as
  // their holders.
  void Insert(PhotoFeaturesPtr features);

  size_t num_bytes() const { return num_bytes_; }
  size_t size() const { return by_use_.size(); }

 private:
  using List = std::list<PhotoFeaturesPtr>;

  void Erase(List::iterator it);

  size_t max_bytes_;
  size_t num_bytes_ = 0;
  List by_use_;  // latest first
  std::unordered_map<int64_t, List::iterator> by_id_;
};

}  // namespace skein
