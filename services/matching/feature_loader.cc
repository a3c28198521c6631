#include "matching/feature_loader.h"

#include <utility>

#include "core/attempt.h"

namespace skein {

FeatureLoader::FeatureLoader(PollLoop& loop, BlobClient& blobs,
                             std::shared_ptr<const DescriptorCells> cells, size_t cache_bytes)
    : blobs_(blobs),
      cells_(std::move(cells)),
      cache_(cache_bytes / 5 * 4),
      coarsest_(cache_bytes / 5),
      decoder_(loop) {}

void FeatureLoader::Load(int64_t image_id, const PhotoEntry& entry, OnLoaded on_loaded) {
  if (PhotoFeaturesPtr cached = cache_.Find(image_id)) return on_loaded(std::move(cached));
  const auto [loading, is_new] = loading_.try_emplace(image_id);
  loading->second.waiting.push_back(std::move(on_loaded));
  if (!is_new) return;
  loading->second.camera = entry.camera;
  Fetch(image_id, entry.keypoints_blob, &Loading::keypoints);
  Fetch(image_id, entry.descriptors_blob, &Loading::descriptors);
}

void FeatureLoader::LoadCoarsest(int64_t image_id, const PhotoEntry& entry, OnLoaded on_loaded) {
  if (PhotoFeaturesPtr cached = coarsest_.Find(image_id)) return on_loaded(std::move(cached));
  Load(image_id, entry, std::move(on_loaded));
}

void FeatureLoader::Fetch(int64_t image_id, const std::string& blob_id, Bytes Loading::*target) {
  blobs_.Fetch(blob_id, "ingest", [this, image_id, target](Result<Bytes> bytes) {
    Loading& loading = loading_.at(image_id);
    if (bytes.ok()) {
      loading.*target = std::move(*bytes);
    } else {
      loading.status = bytes.status();
    }
    if (--loading.num_missing == 0) Decode(image_id, &loading);
  });
}

void FeatureLoader::Decode(int64_t image_id, Loading* loading) {
  if (!loading->status.ok()) return Finish(image_id, loading->status);
  decoder_.Run(
      [image_id, cells = cells_, camera = loading->camera,
       keypoints = std::move(loading->keypoints), descriptors = std::move(loading->descriptors)] {
        return Attempt([&] {
          return DecodePhotoFeatures(image_id, camera, keypoints, descriptors, cells.get());
        });
      },
      [this, image_id](const Result<PhotoFeaturesPtr>& features) {
        if (features.ok()) {
          cache_.Insert(*features);
          coarsest_.Insert(CoarsestAlone(**features));
        }
        Finish(image_id, features);
      });
}

void FeatureLoader::Finish(int64_t image_id, const Result<PhotoFeaturesPtr>& features) {
  const std::vector<OnLoaded> waiting = std::move(loading_.at(image_id).waiting);
  loading_.erase(image_id);
  for (const OnLoaded& on_loaded : waiting) on_loaded(features);
}

}  // namespace skein
