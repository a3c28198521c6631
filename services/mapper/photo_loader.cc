#include "mapper/photo_loader.h"

#include <algorithm>
#include <iterator>

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
  for (const std::optional<Bytes>* blob : {&photo.pairs_blob, &photo.rest_blob}) {
    if (!*blob) continue;
    Result<TwoViewPairs> pairs = DecodeTwoViewPairs(**blob);
    if (!pairs.ok()) return pairs.status().Within("pairs");
    std::move(pairs->begin(), pairs->end(), std::back_inserter(decoded.pairs));
  }
  return decoded;
}

// Of a photo that is there.
Status AddRest(int64_t image_id, const Result<DecodedPhoto>& rest, Submap* submap) {
  const Status status = rest.ok() ? submap->AddPairs(image_id, rest->pairs) : rest.status();
  if (!status.ok()) LogWarn("photo {}, further pairs: {}", image_id, status.error());
  return status;
}

Status AddOne(const FetchedPhoto& photo, Submap* submap) {
  const auto part = submap->options().Enter(SubmapOptions::Part::kPhoto, photo.input.image_id);
  const Result<DecodedPhoto> decoded = Decode(photo);
  const int64_t id = photo.input.image_id;
  if (photo.is_rest) return AddRest(id, decoded, submap);
  if (!decoded.ok()) return decoded.status();
  for (const Status& status :
       {submap->AddPhoto(decoded->input), submap->AddPairs(id, decoded->pairs)}) {
    if (!status.ok()) LogWarn("photo {}: {}", id, status.error());
  }
  submap->AddSimilar(id, photo.distances);
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

void PhotoLoader::Load(const std::vector<int64_t>& image_ids, int64_t seq, OnLoaded on_loaded) {
  requests_.push_back({image_ids, seq, std::move(on_loaded)});
  if (requests_.size() == 1) LoadNext();
}

std::vector<PhotoLoader::Missing> PhotoLoader::FindMissing(const Request& request) {
  std::vector<Missing> missing;
  for (const int64_t id : request.image_ids) {
    const PhotoState* photo = session_.FindPhoto(id);
    const bool has_rest = photo != nullptr && photo->rest_seq > 0 && photo->rest_seq <= request.seq;
    const Missing parts = {id, loaded_.insert(id).second,
                           has_rest && loaded_rests_.insert(id).second};
    if (parts.photo || parts.rest) missing.push_back(parts);
  }
  return missing;
}

void PhotoLoader::LoadNext() {
  const std::vector<Missing> missing = FindMissing(requests_.front());
  using Photos = std::vector<Result<FetchedPhoto>>;
  auto photos = std::make_shared<Photos>(missing.size(), Status::Error("not loaded"));
  if (missing.empty()) return OnAllLoaded(photos);
  auto num_missing = std::make_shared<size_t>(missing.size());
  for (size_t i = 0; i < missing.size(); ++i) {
    LoadOne(missing[i], [this, photos, num_missing, i, parts = missing[i]](auto photo) {
      if (!photo.ok()) Forget(parts);
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

void PhotoLoader::Forget(const Missing& parts) {
  if (parts.photo) loaded_.erase(parts.image_id);
  if (parts.rest) loaded_rests_.erase(parts.image_id);
}

void PhotoLoader::LoadOne(const Missing& missing, OnPhoto on_photo) {
  const PhotoState* photo = session_.FindPhoto(missing.image_id);
  if (photo == nullptr || photo->features_seq == 0) {
    return on_photo(
        NotFound("the ledger has no features of photo " + std::to_string(missing.image_id)));
  }
  auto fetching = std::make_shared<Fetching>();
  fetching->on_photo = std::move(on_photo);
  fetching->photo.input = ToPhotoInput(photo->image, {});
  fetching->photo.is_rest = !missing.photo;
  if (photo->candidates_seq > 0) fetching->photo.distances = ToDistances(photo->candidates);
  const auto fetch_if = [&](bool wanted, const std::string& blob_id, const std::string& what,
                            std::optional<Bytes> FetchedPhoto::*blob) {
    Fetch(wanted ? blob_id : "", what, blob, fetching);
  };
  fetch_if(missing.photo, photo->features.keypoints_blob, "keypoints",
           &FetchedPhoto::keypoints_blob);
  fetch_if(missing.photo, photo->pairs_blob, "pairs", &FetchedPhoto::pairs_blob);
  fetch_if(missing.rest, photo->rest_blob, "further pairs", &FetchedPhoto::rest_blob);
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
