#include "mapper/photo_loader.h"

#include "mapper/messages.h"

namespace skein {

void PhotoLoader::Load(int64_t image_id, OnLoaded on_loaded) {
  const image_t* image = index_.FindImage(image_id);
  const features_t* features = index_.FindFeatures(image_id);
  if (image == nullptr || features == nullptr) {
    return on_loaded(
        Status::Error("the ledger has no features of photo " + std::to_string(image_id)));
  }
  auto loading = std::make_shared<Loading>();
  loading->on_loaded = std::move(on_loaded);
  loading->num_missing = 2;
  if (const candidates_t* candidates = index_.FindCandidates(image_id)) {
    loading->photo.distances = ToDistances(*candidates);
  }
  FetchKeypoints(*image, *features, loading);
  FetchPairs(index_.FindMatches(image_id), loading);
}

void PhotoLoader::FetchKeypoints(const image_t& image, const features_t& features,
                                 const std::shared_ptr<Loading>& loading) {
  loading->photo.input = ToPhotoInput(image, {});
  if (features.keypoints_blob.empty()) return OnOne(loading);
  std::weak_ptr<bool> alive = alive_;
  blobs_.Fetch(features.keypoints_blob, "ingest", [loading, alive](const Result<Bytes>& bytes) {
    if (alive.expired()) return;
    Result<Keypoints> keypoints =
        bytes.ok() ? DecodeKeypoints(*bytes) : Result<Keypoints>(bytes.status());
    if (keypoints.ok()) {
      loading->photo.input.keypoints = std::move(*keypoints);
    } else {
      loading->error = "keypoints: " + keypoints.error();
    }
    OnOne(loading);
  });
}

void PhotoLoader::FetchPairs(const matches_t* matches, const std::shared_ptr<Loading>& loading) {
  if (matches == nullptr || matches->pairs_blob.empty()) return OnOne(loading);
  std::weak_ptr<bool> alive = alive_;
  blobs_.Fetch(matches->pairs_blob, "ingest", [loading, alive](const Result<Bytes>& bytes) {
    if (alive.expired()) return;
    Result<TwoViewPairs> pairs =
        bytes.ok() ? DecodeTwoViewPairs(*bytes) : Result<TwoViewPairs>(bytes.status());
    if (pairs.ok()) {
      loading->photo.pairs = std::move(*pairs);
    } else {
      loading->error = "pairs: " + pairs.error();
    }
    OnOne(loading);
  });
}

void PhotoLoader::OnOne(const std::shared_ptr<Loading>& loading) {
  if (--loading->num_missing > 0) return;
  if (loading->error.empty()) return loading->on_loaded(std::move(loading->photo));
  loading->on_loaded(Status::Error(loading->error));
}

}  // namespace skein
