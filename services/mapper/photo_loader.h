#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "blobs/blob_client.h"
#include "core/result.h"
#include "event_loop/alive.h"
#include "mapping/submap.h"
#include "session/session_state.h"

namespace skein {

// All that a submap needs of a photo, its blobs as they came.
struct FetchedPhoto {
  PhotoInput input;  // without keypoints
  std::optional<Bytes> keypoints_blob, pairs_blob;
};

// Shared, as jobs must be copyable; read once, by the worker.
using FetchedPhotos = std::shared_ptr<const std::vector<Result<FetchedPhoto>>>;

// Decodes the photos and adds those that are sound to the submap. Worker's thread. Returns the last
// error of one that could not be fetched or decoded.
Status AddToSubmap(const FetchedPhotos& photos, Submap* submap);

// Fetches photos' keypoints and pairs by their facts, each photo once. Loads are done one after the
// other: once a load is done, so is what was asked for before it. Loop's thread only; functions of
// loads under way are not called once the loader is gone.
class PhotoLoader {
 public:
  using OnLoaded = std::function<void(FetchedPhotos)>;

  PhotoLoader(BlobClient& blobs, const SessionState& session) : blobs_(blobs), session_(session) {}

  // Gives those of the photos that were not loaded before, in the order of `image_ids`; within the
  // call if there are none and no load is under way. A photo must have features in the ledger;
  // without matches it has no pairs. A photo that could not be fetched is fetched again if it is
  // asked for again.
  void Load(const std::vector<int64_t>& image_ids, OnLoaded on_loaded);

 private:
  using OnPhoto = std::function<void(Result<FetchedPhoto>)>;
  struct Request {
    std::vector<int64_t> image_ids;
    OnLoaded on_loaded;
  };
  struct Fetching {
    FetchedPhoto photo;
    int num_missing = 2;
    Status status;
    OnPhoto on_photo;
  };

  void LoadNext();
  void OnAllLoaded(const FetchedPhotos& photos);
  void LoadOne(int64_t image_id, OnPhoto on_photo);
  // `what` for messages; `blob` is a member of the photo.
  void Fetch(const std::string& blob_id, const std::string& what,
             std::optional<Bytes> FetchedPhoto::*blob, const std::shared_ptr<Fetching>& fetching);
  static void OnOne(const std::shared_ptr<Fetching>& fetching);

  BlobClient& blobs_;
  const SessionState& session_;
  std::deque<Request> requests_;  // the first is under way
  std::set<int64_t> loaded_;
  Alive alive_;
};

}  // namespace skein
