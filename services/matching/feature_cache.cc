#include "matching/feature_cache.h"

#include <iterator>
#include <utility>

namespace skein {

PhotoFeaturesPtr FeatureCache::Find(int64_t image_id) {
  const auto found = by_id_.find(image_id);
  if (found == by_id_.end()) return nullptr;
  by_use_.splice(by_use_.begin(), by_use_, found->second);
  return by_use_.front();
}

void FeatureCache::Insert(PhotoFeaturesPtr features) {
  const auto found = by_id_.find(features->image_id);
  if (found != by_id_.end()) Erase(found->second);
  num_bytes_ += features->MemoryBytes();
  by_use_.push_front(std::move(features));
  by_id_[by_use_.front()->image_id] = by_use_.begin();
  while (num_bytes_ > max_bytes_ && !by_use_.empty()) Erase(std::prev(by_use_.end()));
}

void FeatureCache::Erase(List::iterator it) {
  num_bytes_ -= (*it)->MemoryBytes();
  by_id_.erase((*it)->image_id);
  by_use_.erase(it);
}

}  // namespace skein
