#include "mapper/photo_loader.h"

#include "core/log.h"
#include "mapper/messages.h"

namespace skein {
namespace {

struct DecodedPhoto {
  PhotoInput input;
  TwoViewPairs pairs;
};

Result<DecodedPhoto> Decode(const FetchedPhoto& photo) {
  DecodedPhoto decoded;
  decoded.input = photo.input;
  if (photo.keypoints_blob) {
    Result<Keypoints> keypoints = DecodeKeypoints(*photo.keypoints_blob);
    if (!keypoints.ok()) return keypoints.status().Within("keypoints");
    decoded.input.keypoints = std::move(*keypoints);
  }
  if (photo.pairs_blob) {
    Result<TwoViewPairs> pairs = DecodeTwoViewPairs(*photo.pairs_blob);
    if (!pairs.ok()) return pairs.status().Within("pairs");
    decoded.pairs = std::move(*pairs);
  }
  return decoded;
}

Status AddOne(const FetchedPhoto& photo, Submap* submap) {
  const auto part = submap->options().Enter(SubmapOptions::Part::kPhoto, photo.input.image_id);
  const Result<DecodedPhoto> decoded = Decode(photo);
  if (!decoded.ok()) return decoded.status();
  const int64_t id = photo.input.image_id;
  for (const Status& status :
       {submap->AddPhoto(decoded->input), submap->AddPairs(id, decoded->pairs)}) {
    if (!status.ok()) LogWarn("photo {}: {}", id, status.error());
  }
  return Status::Ok();
}

}  // namespace

Status AddToSubmap(const FetchedPhotos& photos, Submap* submap) {
  Status last = Status::Ok();
  const std::set<int64_t>& left_out = submap->waiting().left_out();
  for (const Result<FetchedPhoto>& photo : *photos) {
    if (photo.ok() && left_out.count(photo->input.image_id) > 0) continue;
    const Status added = photo.ok() ? AddOne(*photo, submap) : photo.status();
    if (!added.ok()) last = added;
  }
  return last;
}

void PhotoLoader::Load(const std::vector<int64_t>& image_ids, OnLoaded on_loaded) {
  requests_.push_back({image_ids, std::move(on_loaded)});
  if (requests_.size() == 1) LoadNext();
}

void PhotoLoader::LoadNext() {
  std::vector<int64_t> missing;
  for (const int64_t id : requests_.front().image_ids) {
    if (loaded_.insert(id).second) missing.push_back(id);
  }
  using Photos = std::vector<Result<FetchedPhoto>>;
  auto photos = std::make_shared<Photos>(missing.size(), Status::Error("not loaded"));
  if (missing.empty()) return OnAllLoaded(photos);
  auto num_missing = std::make_shared<size_t>(missing.size());
  for (size_t i = 0; i < missing.size(); ++i) {
    LoadOne(missing[i], [this, photos, num_missing, i, id = missing[i]](auto photo) {
      if (!photo.ok()) loaded_.erase(id);
      (*photos)[i] = std::move(photo);
      if (--*num_missing == 0) OnAllLoaded(photos);
    });
  }
}

// What is called may ask for more.
void PhotoLoader::OnAllLoaded(const FetchedPhotos& photos) {
  requests_.front().on_loaded(photos);
  requests_.pop_front();
  if (!requests_.empty()) LoadNext();
}

void PhotoLoader::LoadOne(int64_t image_id, OnPhoto on_photo) {
  const PhotoState* photo = session_.FindPhoto(image_id);
  if (photo == nullptr || photo->features_seq == 0) {
    return on_photo(NotFound("the ledger has no features of photo " + std::to_string(image_id)));
  }
  auto fetching = std::make_shared<Fetching>();
  fetching->on_photo = std::move(on_photo);
  fetching->photo.input = ToPhotoInput(photo->image, {});
  Fetch(photo->features.keypoints_blob, "keypoints", &FetchedPhoto::keypoints_blob, fetching);
  Fetch(photo->pairs_blob, "pairs", &FetchedPhoto::pairs_blob, fetching);
}

void PhotoLoader::Fetch(const std::string& blob_id, const std::string& what,
                        std::optional<Bytes> FetchedPhoto::*blob,
                        const std::shared_ptr<Fetching>& fetching) {
  if (blob_id.empty()) return OnOne(fetching);
  blobs_.Fetch(blob_id, "ingest", alive_.Guarded([what, blob, fetching](Result<Bytes> bytes) {
    if (bytes.ok()) {
      fetching->photo.*blob = std::move(*bytes);
    } else {
      fetching->status = bytes.status().Within(what);
    }
    OnOne(fetching);
  }));
}

void PhotoLoader::OnOne(const std::shared_ptr<Fetching>& fetching) {
  if (--fetching->num_missing > 0) return;
  if (!fetching->status.ok()) return fetching->on_photo(fetching->status);
  fetching->on_photo(std::move(fetching->photo));
}

}  // namespace skein
