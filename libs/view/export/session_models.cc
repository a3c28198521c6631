#include "export/session_models.h"

#include <algorithm>

#include "blobs/blob_store.h"
#include "formats/formats.h"
#include "ledger/ledger_store.h"
#include "session/read_session.h"
#include "sfm/model_files.h"
#include "sfm/model_io.h"

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

Result<ExportModel> ExportModelOf(Result<Reconstruction> read, const std::string& label) {
  if (!read) return read.status();
  ExportModel model;
  model.label = label;
  model.reconstruction = std::make_unique<Reconstruction>(std::move(*read));
  return model;
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
  Result<ModelArchive> archive = DecodeModelArchive(bytes);
  if (!archive) return archive.status();
  const std::string kind = submap.kind == submap_model_t::FINAL ? "final" : "checkpoint";
  return ExportModelOf(DecodeModel(std::move(*archive)), "map " + std::to_string(submap.submap_id) +
                                                             ", " + kind + " at " +
                                                             std::to_string(submap.ledger_seq));
}

Result<ExportModel> ReadModelFolder(const fs::path& folder) {
  return ExportModelOf(ReadModelFiles(folder), folder.string());
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
