#pragma once

// Features by image id: from the cache, else fetched and decoded. Loop's thread.

#include <functional>
#include <memory>
#include <unordered_map>
#include <vector>

#include "blobs/blob_client.h"
#include "event_loop/worker_thread.h"
#include "matching/feature_cache.h"
#include "matching/photo_index.h"

namespace skein {

class FeatureLoader {
 public:
  using OnLoaded = std::function<void(const Result<PhotoFeaturesPtr>&)>;

  // A fifth of cache_bytes is for the coarsest features.
  FeatureLoader(PollLoop& loop, BlobClient& blobs, std::shared_ptr<const DescriptorCells> cells,
                size_t cache_bytes);

  // Calls on_loaded once, later, or within the call if the photo is cached. Loads of one photo
  // share their fetches.
  void Load(int64_t image_id, const PhotoEntry& entry, OnLoaded on_loaded);
  // The same, with the photo's coarsest features at least, which are kept longer than the others.
  void LoadCoarsest(int64_t image_id, const PhotoEntry& entry, OnLoaded on_loaded);

 private:
  struct Loading {
    Camera camera;
    Bytes keypoints;
    Bytes descriptors;
    int num_missing = 2;
    Status status;  // why one of them cannot be had
    std::vector<OnLoaded> waiting;
  };

  void Fetch(int64_t image_id, const std::string& blob_id, Bytes Loading::*target);
  void Decode(int64_t image_id, Loading* loading);
  void Finish(int64_t image_id, const Result<PhotoFeaturesPtr>& features);

  BlobClient& blobs_;
  const std::shared_ptr<const DescriptorCells> cells_;
  FeatureCache cache_;
  FeatureCache coarsest_;  // of cache_'s photos and others
  std::unordered_map<int64_t, Loading> loading_;
  WorkerThread decoder_;
};

}  // namespace skein
