#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "blobs/blob_client.h"
#include "core/result.h"
#include "event_loop/alive.h"
#include "mapping/submap.h"
#include "session/session_state.h"

namespace skein {

// All that a submap needs of a photo, its blobs as they came.
struct FetchedPhoto {
  PhotoInput input;      // without keypoints
  bool is_rest = false;  // the photo was fetched before, and has further pairs now
  std::optional<Bytes> keypoints_blob, pairs_blob, rest_blob;
  std::vector<std::pair<uint32_t, double>> distances;
};

// Shared, as jobs must be copyable; read once, by the worker.
using FetchedPhotos = std::shared_ptr<const std::vector<Result<FetchedPhoto>>>;

// Decodes the photos and adds those that are sound to the submap. Worker's thread. Returns the last
// error of one that could not be fetched or decoded.
Status AddToSubmap(const FetchedPhotos& photos, Submap* submap);

// Fetches photos' keypoints and pairs by their facts, each fact's once. Loads are done one after
// the other: once a load is done, so is what was asked for before it. Loop's thread only; functions
// of loads under way are not called once the loader is gone.
class PhotoLoader {
 public:
  using OnLoaded = std::function<void(FetchedPhotos)>;

  PhotoLoader(BlobClient& blobs, const SessionState& session) : blobs_(blobs), session_(session) {}

  // Gives those of the photos that were not loaded before, and the rests of those that were, in the
  // order of `image_ids`; within the call if there are none and no load is under way. A photo must
  // have features in the ledger; without matches it has no pairs. The rest of its matches comes
  // along if the fact's seq is at most `seq`. A photo that could not be fetched is fetched again if
  // it is asked for again.
  void Load(const std::vector<int64_t>& image_ids, int64_t seq, OnLoaded on_loaded);
  // Whether the photo was loaded, or is about to be.
  bool Has(int64_t image_id) const { return loaded_.count(image_id) > 0; }

 private:
  using OnPhoto = std::function<void(Result<FetchedPhoto>)>;
  struct Request {
    std::vector<int64_t> image_ids;
    int64_t seq = 0;
    OnLoaded on_loaded;
  };
  // Parts of a photo that were not loaded before.
  struct Missing {
    int64_t image_id = 0;
    bool photo = false;  // the photo itself, with the pairs that came first
    bool rest = false;
  };
  struct Fetching {
    FetchedPhoto photo;
    int num_missing = 3;
    Status status;
    OnPhoto on_photo;
  };

  void LoadNext();
  void OnAllLoaded(const FetchedPhotos& photos);
  std::vector<Missing> FindMissing(const Request& request);
  void Forget(const Missing& parts);
  void LoadOne(const Missing& missing, OnPhoto on_photo);
  // `what` for messages; `blob` is a member of the photo.
  void Fetch(const std::string& blob_id, const std::string& what,
             std::optional<Bytes> FetchedPhoto::*blob, const std::shared_ptr<Fetching>& fetching);
  static void OnOne(const std::shared_ptr<Fetching>& fetching);

  BlobClient& blobs_;
  const SessionState& session_;
  std::deque<Request> requests_;  // the first is under way
  std::set<int64_t> loaded_;
  std::set<int64_t> loaded_rests_;
  Alive alive_;
};

}  // namespace skein
