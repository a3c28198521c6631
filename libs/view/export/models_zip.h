#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/result.h"
#include "export/session_models.h"

namespace skein {

// The models in a format (export/model_writer.h) as one zip file: 0/, 1/, ... as `skein export`
// writes them, with georeference.json where they are georeferenced. `file` must not exist.
Status WriteModelsZip(const std::vector<ExportModel>& models, const std::string& format,
                      const std::filesystem::path& file);

}  // namespace skein
