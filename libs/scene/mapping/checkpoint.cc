#include "mapping/checkpoint.h"

#include "core/bytes.h"
#include "sfm/model_io.h"

namespace skein {
namespace {

constexpr char kStateFile[] = "state.bin";
constexpr uint32_t kIdentifier = 0x4E534B53;  // "SKSN"
constexpr uint32_t kVersion = 3;

Bytes EncodeState(const SubmapState& state) {
  ByteWriter writer;
  writer.Put(kIdentifier);
  writer.Put(kVersion);
  writer.Put<uint64_t>(state.photos.size());
  for (const int64_t id : state.photos) writer.Put(id);
  writer.Put<uint64_t>(state.is_camera_refined.size());
  for (const auto& [id, is_refined] : state.is_camera_refined) {
    writer.Put<uint32_t>(id);
    writer.Put<uint8_t>(is_refined);
  }
  writer.Put<uint64_t>(state.trials.size());
  for (const auto& [id, trial] : state.trials) {
    writer.Put<uint32_t>(id);
    writer.Put<int32_t>(trial.last_visible);
    writer.Put<int32_t>(trial.num_withdrawals);
    writer.Put<uint8_t>(trial.deferred);
    writer.Put<uint8_t>(trial.rejected);
    writer.Put<uint8_t>(trial.of_similar_place);
  }
  writer.Put(state.size_at_global.num_images);
  writer.Put(state.size_at_global.num_points);
  writer.Put(state.first);
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

bool GetCameras(ByteReader* reader, std::map<CameraId, bool>* is_camera_refined) {
  uint64_t count = 0;
  if (!GetCount(reader, 5, &count)) return false;
  for (uint64_t i = 0; i < count; ++i) {
    uint32_t id = 0;
    uint8_t is_refined = 0;
    reader->Get(&id);
    reader->Get(&is_refined);
    (*is_camera_refined)[id] = is_refined != 0;
  }
  return true;
}

bool GetTrials(ByteReader* reader, std::map<ImageId, TrialRecord>* trials) {
  uint64_t count = 0;
  if (!GetCount(reader, 15, &count)) return false;
  for (uint64_t i = 0; i < count; ++i) {
    uint32_t id = 0;
    int32_t visible = 0, withdrawals = 0;
    uint8_t deferred = 0, rejected = 0, of_similar_place = 0;
    reader->Get(&id);
    reader->Get(&visible);
    reader->Get(&withdrawals);
    reader->Get(&deferred);
    reader->Get(&rejected);
    reader->Get(&of_similar_place);
    (*trials)[id] = {visible, withdrawals, deferred != 0, rejected != 0, of_similar_place != 0};
  }
  return true;
}

bool GetState(ByteReader* reader, SubmapState* state) {
  return GetPhotos(reader, &state->photos) && GetCameras(reader, &state->is_camera_refined) &&
         GetTrials(reader, &state->trials) && reader->Get(&state->size_at_global.num_images) &&
         reader->Get(&state->size_at_global.num_points) && reader->Get(&state->first) &&
         reader->remaining() == 0;
}

Result<SubmapState> DecodeState(const ModelArchive& archive) {
  const auto file = archive.find(kStateFile);
  if (file == archive.end()) return DataLoss("model archive without state.bin");
  ByteReader reader(file->second);
  uint32_t identifier = 0, version = 0;
  if (!reader.Get(&identifier) || !reader.Get(&version) || identifier != kIdentifier) {
    return DataLoss("state.bin is something else");
  }
  if (version != kVersion) return DataLoss("state.bin of another version");
  SubmapState state;
  if (!GetState(&reader, &state)) return DataLoss("state.bin is damaged");
  return state;
}

}  // namespace

ModelArchive SaveSubmap(Submap* submap) {
  submap->map().ColourPoints();
  ModelArchive archive = EncodeModel(submap->map().reconstruction());
  archive[kStateFile] = EncodeState(submap->State());
  return archive;
}

Result<std::vector<int64_t>> PhotosOfArchive(const ModelArchive& archive) {
  const Result<SubmapState> state = DecodeState(archive);
  if (!state.ok()) return state.status();
  return state->photos;
}

Status RestoreSubmap(const ModelArchive& archive, Submap* submap) {
  const Result<SubmapState> state = DecodeState(archive);
  if (!state.ok()) return state.status();
  const Result<Reconstruction> model = DecodeModel(archive);
  if (!model.ok()) return model.status();
  return submap->Restore(*model, *state);
}

}  // namespace skein
