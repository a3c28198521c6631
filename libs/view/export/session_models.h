// Models for export: the newest of each submap, and the facts of the photos.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/bytes.h"
#include "core/result.h"
#include "geometry/georeference.h"
#include "ledger/session_folder.h"
#include "session/session_state.h"
#include "sfm/reconstruction.h"

namespace skein {

struct ExportModel {
  std::string label;  // "map 3, checkpoint at 812" or the folder
  std::unique_ptr<Reconstruction> reconstruction;
  nlohmann::json georeference;  // see GeoreferenceToJson; null in the mapper's frame
};

// The latest model of each submap that lives, most photos first.
std::vector<submap_model_t> LatestModels(const SessionState& state);

// Reads a model from the bytes of its blob.
Result<ExportModel> ReadModelArchive(const submap_model_t& submap, const Bytes& archive);

// The newest checkpoint or final model of every live submap in the ledger, most photos first. Works
// while the session runs and writes nothing to it. Falls back on sparse/ when the ledger has no
// model. Empty when there is none yet.
Result<std::vector<ExportModel>> ReadSessionModels(const SessionPaths& paths);

// The positions that photos carry, by AGENT/NAME.
Result<std::map<std::string, GeodeticPosition>> ReadPositions(const SessionPaths& paths);

// A COLMAP model folder, binary or text with all three files.
Result<ExportModel> ReadModelFolder(const std::filesystem::path& folder);

}  // namespace skein
