#pragma once

#include <functional>
#include <memory>
#include <string>

#include "core/result.h"
#include "event_loop/alive.h"
#include "formats/formats.h"
#include "mapper/photo_loader.h"
#include "mapper/submap_worker.h"

namespace skein {

// A model archive, and those of its photos that the submap does not have.
struct LoadedModel {
  std::shared_ptr<ModelArchive> archive;  // of the job that decodes it, which may use it up
  FetchedPhotos photos;
};

// Fetches a submap's model and then the photos it is of. One trip to the worker: to decode the
// archive, which names the photos. Loop's thread only; functions are not called once it is gone.
class ModelLoader {
 public:
  using OnLoaded = std::function<void(Result<LoadedModel>)>;

  ModelLoader(BlobClient& blobs, SubmapWorker& worker, PhotoLoader& photos)
      : blobs_(blobs), worker_(worker), photos_(photos) {}

  void Load(const std::string& step, const std::string& blob_id, OnLoaded on_loaded);

 private:
  BlobClient& blobs_;
  SubmapWorker& worker_;
  PhotoLoader& photos_;
  Alive alive_;
};

}  // namespace skein
