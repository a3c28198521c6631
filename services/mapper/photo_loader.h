#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "blobs/blob_client.h"
#include "core/result.h"
#include "mapper/ledger_index.h"
#include "mapping/submap.h"

namespace skein {

// All that the core needs of a photo.
struct LoadedPhoto {
  PhotoInput input;
  TwoViewPairs pairs;
  std::vector<std::pair<uint32_t, double>> distances;
};

// Fetches a photo's keypoints and pairs by its facts in the index. Loop's thread only; functions of
// loads under way are not called once the loader is gone.
class PhotoLoader {
 public:
  using OnLoaded = std::function<void(Result<LoadedPhoto>)>;

  PhotoLoader(BlobClient& blobs, const LedgerIndex& index) : blobs_(blobs), index_(index) {}

  // The photo must have features in the index; without matches it has no pairs of its own.
  void Load(int64_t image_id, OnLoaded on_loaded);

 private:
  struct Loading {
    LoadedPhoto photo;
    int num_missing = 0;
    std::string error;
    OnLoaded on_loaded;
  };

  void FetchKeypoints(const image_t& image, const features_t& features,
                      const std::shared_ptr<Loading>& loading);
  void FetchPairs(const matches_t* matches, const std::shared_ptr<Loading>& loading);
  static void OnOne(const std::shared_ptr<Loading>& loading);

  BlobClient& blobs_;
  const LedgerIndex& index_;
  std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
};

}  // namespace skein
