#include "clients/export/export.h"

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "clients/export/database.h"
#include "clients/export/georeferenced.h"
#include "clients/export/picture.h"
#include "clients/export/unmirrored.h"
#include "clients/progress_bar.h"
#include "clients/subcommand.h"
#include "core/file.h"
#include "export/model_writer.h"
#include "export/session_models.h"

namespace skein {
namespace {

namespace fs = std::filesystem;

constexpr int kPictureSidePx = 1000;

struct ExportOptions {
  std::string session, model, output, picture;
  std::vector<std::string> formats = {"bin"};
  bool georeferenced = false;
};

std::vector<ExportModel> ReadModels(const ExportOptions& options) {
  if (!options.model.empty()) {
    Result<ExportModel> model = ReadModelFolder(options.model);
    if (!model) throw std::runtime_error(model.error());
    std::vector<ExportModel> models;
    models.push_back(std::move(*model));
    return models;
  }
  Result<std::vector<ExportModel>> models = ReadSessionModels(SessionPaths{options.session});
  if (!models) throw std::runtime_error(models.error());
  return std::move(*models);
}

void PlaceModels(const ExportOptions& options, std::vector<ExportModel>* models) {
  const auto positions = ReadPositions(SessionPaths{options.session});
  if (!positions) throw std::runtime_error(positions.error());
  std::vector<std::string> refusals;
  PlaceOnEarth(*positions, models, &refusals);
  for (const std::string& refusal : refusals) {
    std::cerr << "skein export: left out, as it can't be georeferenced: " << refusal << "\n";
  }
  if (models->empty()) throw std::runtime_error("no model can be georeferenced");
}

void WriteTextFile(const std::string& text, const fs::path& path) {
  const Status written = WriteFileAtomic(path.string(), text.data(), text.size());
  if (!written.ok()) throw std::runtime_error(written.error());
}

void WritePicture(const colmap::Reconstruction& model, const fs::path& path) {
  Bytes png;
  if (!cv::imencode(".png", DrawModel(model, kPictureSidePx), png)) {
    throw std::runtime_error("OpenCV could not encode a PNG");
  }
  const Status written = WriteFileAtomic(path.string(), png);
  if (!written.ok()) throw std::runtime_error(written.error());
}

void WriteModels(const std::vector<ExportModel>& models, const ExportOptions& options) {
  std::vector<std::string> formats = options.formats;
  formats.erase(std::remove(formats.begin(), formats.end(), "database"), formats.end());
  ProgressBar progress("models", static_cast<int64_t>(models.size() * formats.size()));
  for (size_t i = 0; i < models.size(); ++i) {
    const fs::path folder = fs::path(options.output) / std::to_string(i);
    fs::create_directories(folder);
    for (const std::string& format : formats) {
      const Status written = WriteModel(*models[i].reconstruction, format, folder);
      if (!written.ok()) throw std::runtime_error(written.error());
      progress.Add();
    }
    if (!models[i].georeference.is_null()) {
      WriteTextFile(models[i].georeference.dump(2) + "\n", folder / "georeference.json");
    }
    std::cout << folder.string() << ": " << models[i].label << ", "
              << models[i].reconstruction->NumRegImages() << " photos, "
              << models[i].reconstruction->NumPoints3D() << " points" << std::endl;
  }
}

void ExportDatabase(const ExportOptions& options) {
  fs::create_directories(options.output);
  const fs::path file = fs::path(options.output) / "database.db";
  const Result<DatabaseCounts> counts = WriteDatabase(SessionPaths{options.session}, file);
  if (!counts) throw std::runtime_error(counts.error());
  std::cout << file.string() << ": " << counts->images << " photos, " << counts->pairs
            << " verified pairs" << std::endl;
}

void ExportUnmirrored(const ExportOptions& options) {
  const fs::path folder = fs::path(options.output) / "unmirrored";
  const Result<int> count = WriteUnmirrored(SessionPaths{options.session}, folder);
  if (!count) throw std::runtime_error(count.error());
  if (*count == 0) return;
  std::cout << folder.string() << ": " << *count
            << " photos that are stored as mirror images, as the models have them; other programs "
               "need them in place of those in images/"
            << std::endl;
}

// Empty when the options go together; else what to do.
std::string CheckOptions(const ExportOptions& options, bool database) {
  if (options.session.empty() == options.model.empty()) return "give --session or --model";
  if (options.output.empty() && options.picture.empty()) return "give --output or --picture";
  if (database && options.session.empty()) return "the database comes from a --session";
  if (options.georeferenced && options.session.empty()) return "positions come from a --session";
  return "";
}

}  // namespace

int RunExport(int argc, char** argv) {
  ExportOptions options;
  std::vector<std::string> known = ModelFormats();
  known.push_back("database");
  CLI::App app(
      "Exports a session's submaps, at any time, also while it runs: OUTPUT/0 is the one with "
      "most\n"
      "photos. database: OUTPUT/database.db with features and verified matches for COLMAP.",
      "skein export");
  app.add_option("--session", options.session, "Session folder")->check(CLI::ExistingDirectory);
  app.add_option("--model", options.model, "Or: a COLMAP model folder")
      ->check(CLI::ExistingDirectory);
  app.add_option("--output", options.output, "Folder to write into");
  app.add_option("--format", options.formats, "One or more, separated by commas")
      ->delimiter(',')
      ->check(CLI::IsMember(known))
      ->capture_default_str();
  app.add_option("--picture", options.picture,
                 "PNG of the largest model: points and cameras from above and obliquely");
  app.add_flag("--georeferenced", options.georeferenced,
               "Models in metres east, north and up of an origin, from the photos' GPS; how is in\n"
               "OUTPUT/N/georeference.json");
  if (const auto code = ParseOptions(&app, argc, argv)) return *code;
  if (!options.session.empty()) {
    const Result<Session> session = OpenSession(options.session);
    if (!session.ok()) throw std::runtime_error(session.error());
  }
  const bool database = std::count(options.formats.begin(), options.formats.end(), "database") > 0;
  if (const std::string wrong = CheckOptions(options, database); !wrong.empty()) {
    std::cerr << "skein export: " << wrong << "\n";
    return kExitUsage;
  }
  if (database && !options.output.empty()) ExportDatabase(options);
  if (!options.session.empty() && !options.output.empty()) ExportUnmirrored(options);
  const bool only_database = database && options.formats.size() == 1;
  if (only_database && options.picture.empty()) return kExitOk;

  std::vector<ExportModel> models = ReadModels(options);
  if (models.empty()) throw std::runtime_error("the session has no model yet");
  if (options.georeferenced) PlaceModels(options, &models);
  if (!options.output.empty() && !only_database) WriteModels(models, options);
  if (!options.picture.empty()) WritePicture(*models.front().reconstruction, options.picture);
  return kExitOk;
}

}  // namespace skein
