#include "mapping/checkpoint.h"

#include <algorithm>
#include <cmath>

#include "core/bytes.h"
#include "map/model_io.h"

namespace skein {
namespace {

constexpr uint32_t kIdentifier = 0x4E534B53;  // "SKSN"
constexpr uint32_t kVersion = 2;

struct CameraSide {
  uint32_t id = 0;
  bool refined = false;
};

struct SideFile {
  std::vector<int64_t> photos;
  std::vector<CameraSide> cameras;
  Submap::Side side;
};

void PutTrials(const std::map<ImageId, Submap::Trial>& trials, ByteWriter* writer) {
  writer->Put<uint64_t>(trials.size());
  for (const auto& [id, trial] : trials) {
    writer->Put<uint32_t>(id);
    writer->Put<int32_t>(trial.last_visible);
    writer->Put<int32_t>(trial.num_withdrawals);
    writer->Put<uint8_t>(trial.deferred);
    writer->Put<uint8_t>(trial.rejected);
    writer->Put<uint8_t>(trial.looks_alike);
  }
}

void PutSimilar(const SimilarityLists& lists, ByteWriter* writer) {
  std::vector<uint32_t> ids;
  for (const auto& [id, list] : lists.all()) ids.push_back(id);
  std::sort(ids.begin(), ids.end());
  writer->Put<uint64_t>(ids.size());
  for (const uint32_t id : ids) {
    writer->Put(id);
    writer->Put<uint64_t>(lists.Of(id).size());
    for (const Similar& similar : lists.Of(id)) {
      writer->Put(similar.image_id);
      writer->Put(similar.similarity);
    }
  }
}

Bytes EncodeSide(const Submap& submap) {
  ByteWriter writer;
  writer.Put(kIdentifier);
  writer.Put(kVersion);
  writer.Put<uint64_t>(submap.map().photos().size());
  for (const ImageId id : submap.map().photos()) writer.Put<int64_t>(id);
  writer.Put<uint64_t>(submap.map().camera_states().size());
  for (const auto& [id, state] : submap.map().camera_states()) {
    writer.Put<uint32_t>(id);
    writer.Put<uint8_t>(state.refined);
  }
  PutTrials(submap.side().trials, &writer);
  PutSimilar(submap.side().similar, &writer);
  writer.Put(submap.side().images_at_global);
  writer.Put(submap.side().points_at_global);
  writer.Put(submap.side().first);
  return writer.Take();
}

// A count of elements of at least `size` bytes each.
bool GetCount(ByteReader* reader, size_t size, uint64_t* count) {
  return reader->Get(count) && *count <= reader->remaining() / size;
}

bool GetPhotos(ByteReader* reader, std::vector<int64_t>* photos) {
  uint64_t count = 0;
  if (!GetCount(reader, 8, &count)) return false;
  photos->resize(count);
  for (int64_t& id : *photos) reader->Get(&id);
  return true;
}

bool GetCameras(ByteReader* reader, std::vector<CameraSide>* cameras) {
  uint64_t count = 0;
  if (!GetCount(reader, 5, &count)) return false;
  cameras->resize(count);
  for (CameraSide& camera : *cameras) {
    uint8_t refined = 0;
    reader->Get(&camera.id);
    reader->Get(&refined);
    camera.refined = refined != 0;
  }
  return true;
}

bool GetTrials(ByteReader* reader, std::map<ImageId, Submap::Trial>* trials) {
  uint64_t count = 0;
  if (!GetCount(reader, 15, &count)) return false;
  for (uint64_t i = 0; i < count; ++i) {
    uint32_t id = 0;
    int32_t visible = 0, withdrawals = 0;
    uint8_t deferred = 0, rejected = 0, looks_alike = 0;
    reader->Get(&id);
    reader->Get(&visible);
    reader->Get(&withdrawals);
    reader->Get(&deferred);
    reader->Get(&rejected);
    reader->Get(&looks_alike);
    (*trials)[id] = {visible, withdrawals, deferred != 0, rejected != 0, looks_alike != 0};
  }
  return true;
}

bool GetSimilar(ByteReader* reader, SimilarityLists* lists) {
  uint64_t count = 0;
  if (!GetCount(reader, 12, &count)) return false;
  for (uint64_t i = 0; i < count; ++i) {
    uint32_t id = 0;
    uint64_t length = 0;
    if (!reader->Get(&id) || !GetCount(reader, 12, &length)) return false;
    std::vector<Similar> list(length);
    for (Similar& similar : list) {
      reader->Get(&similar.image_id);
      reader->Get(&similar.similarity);
      if (!(similar.similarity > 0) || similar.similarity > 1) return false;
    }
    lists->Set(id, std::move(list));
  }
  return true;
}

Result<SideFile> DecodeSide(const ModelArchive& archive) {
  const auto file = archive.find("side.bin");
  if (file == archive.end()) return Status::Error("model archive without side.bin");
  ByteReader reader(file->second);
  uint32_t identifier = 0, version = 0;
  if (!reader.Get(&identifier) || !reader.Get(&version) || identifier != kIdentifier) {
    return Status::Error("side.bin is something else");
  }
  if (version != kVersion) return Status::Error("side.bin of another version");
  SideFile side;
  if (!GetPhotos(&reader, &side.photos) || !GetCameras(&reader, &side.cameras) ||
      !GetTrials(&reader, &side.side.trials) || !GetSimilar(&reader, &side.side.similar) ||
      !reader.Get(&side.side.images_at_global) || !reader.Get(&side.side.points_at_global) ||
      !reader.Get(&side.side.first) || reader.remaining() != 0) {
    return Status::Error("side.bin is damaged");
  }
  return side;
}

}  // namespace

ModelArchive SaveSubmap(Submap* submap) {
  submap->map().ColourPoints();
  ModelArchive archive = EncodeModel(submap->map().reconstruction());
  archive["side.bin"] = EncodeSide(*submap);
  return archive;
}

Result<std::vector<int64_t>> PhotosOfArchive(const ModelArchive& archive) {
  const Result<SideFile> side = DecodeSide(archive);
  if (!side.ok()) return side.status();
  return side->photos;
}

Status RestoreSubmap(const ModelArchive& archive, Submap* submap) {
  const Result<SideFile> side = DecodeSide(archive);
  if (!side.ok()) return side.status();
  const Result<colmap::Reconstruction> model = DecodeModel(archive);
  if (!model.ok()) return model.status();
  const Status status = submap->ReplaceModel(*model);
  if (!status.ok()) return status;
  submap->set_side(side->side);
  for (const CameraSide& camera : side->cameras) {
    if (submap->map().camera_states().count(camera.id) == 0) continue;
    submap->map().camera_state(camera.id).refined = camera.refined;
  }
  return Status::Ok();
}

}  // namespace skein
