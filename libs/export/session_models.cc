#include "export/session_models.h"

#include <algorithm>

#include "blobs/blob_store.h"
#include "core/file.h"
#include "export/temporary_folder.h"
#include "formats/formats.h"
#include "geometry/model_poses.h"
#include "ledger/ledger_store.h"
#include "session/read_session.h"

namespace skein {
namespace {

namespace fs = std::filesystem;

Result<SessionState> ReadState(const SessionPaths& paths) {
  const Result<std::unique_ptr<Ledger>> ledger = Ledger::OpenReadOnly(paths.Ledger());
  return ledger ? ReadSession(**ledger) : ledger.status();
}

Result<std::vector<ExportModel>> ReadSparse(const fs::path& sparse) {
  std::vector<ExportModel> models;
  for (int i = 0; fs::exists(sparse / std::to_string(i)); ++i) {
    Result<ExportModel> model = ReadModelFolder(sparse / std::to_string(i));
    if (!model) return model.status();
    models.push_back(std::move(*model));
  }
  return models;
}

}  // namespace

std::vector<submap_model_t> LatestModels(const SessionState& state) {
  std::vector<submap_model_t> models;
  for (const auto& [id, submap] : state.submaps()) {
    if (!submap.ended && submap.latest_model) models.push_back(*submap.latest_model);
  }
  std::stable_sort(
      models.begin(), models.end(),
      [](const submap_model_t& a, const submap_model_t& b) { return a.num_images > b.num_images; });
  return models;
}

Result<ExportModel> ReadModelArchive(const submap_model_t& submap, const Bytes& bytes) {
  const Result<ModelArchive> archive = DecodeModelArchive(bytes);
  if (!archive) return archive.status();
  const TemporaryFolder folder;
  for (const char* name : {"cameras.bin", "images.bin", "points3D.bin"}) {
    const auto file = archive->find(name);
    if (file == archive->end()) return DataLoss(std::string("a model lacks ") + name);
    const Status written = WriteFileAtomic((folder.path() / name).string(), file->second);
    if (!written.ok()) return written;
  }
  Result<ExportModel> model = ReadModelFolder(folder.path());
  if (!model) return model;
  model->label = "submap " + std::to_string(submap.submap_id) +
                 (submap.kind == submap_model_t::FINAL ? ", final at " : ", checkpoint at ") +
                 std::to_string(submap.ledger_seq);
  return model;
}

Result<ExportModel> ReadModelFolder(const fs::path& folder) {
  const bool binary = fs::exists(folder / "points3D.bin");
  for (const char* name : {"cameras", "images", "points3D"}) {
    const fs::path file = folder / (std::string(name) + (binary ? ".bin" : ".txt"));
    if (!fs::exists(file)) return NotFound("there is no " + file.string());
  }
  // COLMAP's reader aborts on damaged files, so the file is checked first.
  const Result<ModelPoses> readable = ReadColmapPoses(folder);
  if (!readable) return readable.status();
  ExportModel model;
  model.label = folder.string();
  model.reconstruction = std::make_unique<colmap::Reconstruction>();
  model.reconstruction->Read(folder.string());
  return model;
}

Result<std::vector<ExportModel>> ReadSessionModels(const SessionPaths& paths) {
  std::vector<ExportModel> models;
  if (fs::exists(paths.Ledger())) {
    const Result<SessionState> state = ReadState(paths);
    if (!state) return state.status();
    const BlobStore blobs(paths.Blobs());
    for (const submap_model_t& submap : LatestModels(*state)) {
      const Result<Bytes> archive = blobs.Get(submap.model_blob);
      if (!archive) return archive.status();
      Result<ExportModel> model = ReadModelArchive(submap, *archive);
      if (!model) return model.status();
      models.push_back(std::move(*model));
    }
  }
  if (models.empty()) return ReadSparse(paths.Sparse());
  return models;
}

Result<std::map<std::string, GeodeticPosition>> ReadPositions(const SessionPaths& paths) {
  const Result<SessionState> state = ReadState(paths);
  if (!state) return state.status();
  return PositionsOf(*state);
}

}  // namespace skein
