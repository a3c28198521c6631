#include "mapper/model_loader.h"

#include <cstdint>
#include <utility>
#include <vector>

#include "mapping/checkpoint.h"

namespace skein {
namespace {

struct DecodedModel {
  std::shared_ptr<ModelArchive> archive;
  std::vector<int64_t> photos;
};

Result<DecodedModel> Decode(const Bytes& bytes) {
  Result<ModelArchive> archive = DecodeModelArchive(bytes);
  if (!archive.ok()) return archive.status();
  Result<std::vector<int64_t>> photos = PhotosOfArchive(*archive);
  if (!photos.ok()) return photos.status();
  return DecodedModel{std::make_shared<ModelArchive>(std::move(*archive)), std::move(*photos)};
}

}  // namespace

void ModelLoader::Load(const std::string& step, const std::string& blob_id, OnLoaded on_loaded) {
  const auto on_decoded = [this, on_loaded](const Result<DecodedModel>& model) {
    if (!model.ok()) return on_loaded(model.status());
    photos_.Load(model->photos, [on_loaded, archive = model->archive](FetchedPhotos photos) {
      on_loaded(LoadedModel{archive, std::move(photos)});
    });
  };
  blobs_.Fetch(
      blob_id, "ingest", alive_.Guarded([this, step, on_loaded, on_decoded](Result<Bytes> bytes) {
        if (!bytes.ok()) return on_loaded(bytes.status());
        worker_.Run(
            step, [bytes = std::move(*bytes)](Submap&) { return Decode(bytes); }, on_decoded);
      }));
}

}  // namespace skein
