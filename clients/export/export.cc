#include "clients/export/export.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <iterator>
#include <opencv2/imgcodecs.hpp>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "clients/export/database.h"
#include "clients/export/dense_folder.h"
#include "clients/export/photo_source.h"
#include "clients/export/picture.h"
#include "clients/export/training_folder.h"
#include "clients/export/unmirrored.h"
#include "clients/progress_bar.h"
#include "clients/subcommand.h"
#include "core/file.h"
#include "export/georeferenced.h"
#include "export/model_writer.h"
#include "export/session_models.h"
#include "export/written_names.h"
#include "geometry/georeference_json.h"

namespace skein {
namespace {

namespace fs = std::filesystem;

constexpr int kPictureSidePx = 1000;
constexpr char kDatabase[] = "database";
// A glTF file has less than 4 GiB, and 28 bytes a triangle.
constexpr int64_t kLeastTriangles = 1000, kMostTriangles = 100'000'000;

struct ExportOptions {
  std::string session, model, images, output, picture;
  std::vector<std::string> formats = {"bin"};
  int depth_size_px = DenseOptions().size_px;
  int64_t mesh_triangles = DenseOptions().mesh_triangles;
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
  if (models->empty()) {
    throw std::runtime_error(
        "no model can be georeferenced; without --georeferenced the map has a frame of its own");
  }
}

void WritePicture(const Reconstruction& model, const fs::path& path) {
  Bytes png;
  if (!cv::imencode(".png", DrawModel(model, kPictureSidePx), png)) {
    throw std::runtime_error("OpenCV could not encode a PNG");
  }
  const Status written = WriteFileAtomic(path.string(), png);
  if (!written.ok()) throw std::runtime_error(written.error());
}

bool IsTraining(const std::string& format) {
  return format == kNerfstudio || format == kGaussianSplatting;
}

constexpr const char* kDenseFormats[] = {kDepth, kDense, kLas, kMesh, kOrthophoto};

bool IsDense(const std::string& format) {
  return std::count(std::begin(kDenseFormats), std::end(kDenseFormats), format) > 0;
}

using IsOfKind = bool (*)(const std::string& format);

std::set<std::string> FormatsOfKind(const ExportOptions& options, IsOfKind is_of_kind) {
  std::set<std::string> formats;
  std::copy_if(options.formats.begin(), options.formats.end(),
               std::inserter(formats, formats.end()), is_of_kind);
  return formats;
}

bool Has(const ExportOptions& options, const std::string& format) {
  return std::count(options.formats.begin(), options.formats.end(), format) > 0;
}

// Formats with photos; none where there are no photos to undistort.
std::set<std::string> TrainingFormats(const ExportOptions& options) {
  if (options.session.empty() && options.images.empty()) return {};
  return FormatsOfKind(options, IsTraining);
}

// Formats that libs/view/export writes: neither the database nor folders that need photos.
std::vector<std::string> PlainFormats(const ExportOptions& options) {
  const std::set<std::string> training = TrainingFormats(options);
  std::vector<std::string> formats;
  for (const std::string& format : options.formats) {
    if (format != kDatabase && !IsDense(format) && training.count(format) == 0) {
      formats.push_back(format);
    }
  }
  return formats;
}

void ThrowUnlessOk(const Status& status) {
  if (!status.ok()) throw std::runtime_error(status.error());
}

fs::path FolderOf(const ExportOptions& options, size_t i) {
  return fs::path(options.output) / std::to_string(i);
}

void WriteModels(const std::vector<ExportModel>& models, const ExportOptions& options) {
  const std::vector<std::string> formats = PlainFormats(options);
  ProgressBar progress("models", static_cast<int64_t>(models.size() * formats.size()));
  for (size_t i = 0; i < models.size(); ++i) {
    const fs::path folder = FolderOf(options, i);
    const Reconstruction& model = *models[i].reconstruction;
    fs::create_directories(folder);
    for (const std::string& format : formats) {
      ThrowUnlessOk(WriteModel(model, format, folder));
      if (PartsNamesAtBlanks(format) && NumNamesWithBlanks(model) > 0) {
        std::cerr << "skein export: " << format
                  << " parts names at blanks: " << NumNamesWithBlanks(model)
                  << " photos are written with '_' in their place, "
                  << "listed in " << folder.string() << "/*.names.txt" << std::endl;
      }
      if (format == kNerfstudio) {
        std::cerr << "skein export: without --images no photos are undistorted: "
                  << (folder / "transforms.json").string()
                  << " is of the photos as they are, to be put into "
                  << (folder / "images").string() << std::endl;
      }
      progress.Add();
    }
    ThrowUnlessOk(WriteGeoreference(models[i], folder));
    std::cout << folder.string() << ": " << models[i].label << ", " << model.NumRegImages()
              << " photos, " << model.NumPoints3D() << " points" << std::endl;
  }
}

PhotoSource OpenPhotos(const ExportOptions& options) {
  Result<PhotoSource> photos = options.session.empty()
                                   ? PhotosOfFolder(options.images)
                                   : PhotosOfSession(SessionPaths{options.session});
  ThrowUnlessOk(photos.status());
  return *std::move(photos);
}

int64_t CountPhotos(const std::vector<ExportModel>& models) {
  int64_t count = 0;
  for (const ExportModel& model : models) {
    count += static_cast<int64_t>(model.reconstruction->NumRegImages());
  }
  return count;
}

void WriteTrainingFolders(const std::vector<ExportModel>& models, const ExportOptions& options) {
  const PhotoSource photos = OpenPhotos(options);
  ProgressBar progress("photos", CountPhotos(models));
  for (size_t i = 0; i < models.size(); ++i) {
    ThrowUnlessOk(WriteTrainingFolder(
        *models[i].reconstruction, TrainingFormats(options), photos, [&] { progress.Add(); },
        FolderOf(options, i)));
  }
}

void TellGround(const DenseFigures& figures) {
  std::cout << ", an orthophoto of " << figures.cell;
  if (figures.quality.in_metres) {
    std::cout << " m a pixel, ";
  } else {
    std::cout << " units of the map a pixel, without scale and north, up from the " << figures.up
              << ", ";
  }
  std::cout << std::lround(100 * figures.grid_completeness) << " % of its area known";
}

void TellFigures(const DenseFigures& figures, const ExportOptions& options) {
  std::cout << "depths at " << std::lround(100 * figures.quality.completeness)
            << " % of the photos' pixels";
  if (Has(options, kDense) || Has(options, kLas)) {
    std::cout << ", " << figures.num_points << " dense points";
  }
  if (Has(options, kMesh)) {
    const double pixels =
        figures.quality.mesh_voxel.value_or(0) / figures.quality.ground_sampling_distance;
    std::cout << ", a mesh of " << figures.num_triangles << " triangles, "
              << 100 * figures.num_textured / figures.num_triangles
              << " % of them with a texture, its voxels " << std::lround(10 * pixels) / 10.0
              << " pixels wide on the ground";
  }
  if (Has(options, kOrthophoto)) TellGround(figures);
  std::cout << std::endl << LineOf(figures.quality) << std::endl;
}

void WriteDenseFolders(const std::vector<ExportModel>& models, const ExportOptions& options) {
  const PhotoSource photos = OpenPhotos(options);
  ProgressBar progress("depth maps", CountPhotos(models));
  for (size_t i = 0; i < models.size(); ++i) {
    DenseOptions dense;
    dense.formats = FormatsOfKind(options, IsDense);
    dense.size_px = options.depth_size_px;
    dense.mesh_triangles = options.mesh_triangles;
    if (options.georeferenced) dense.origin = OriginOf(models[i].georeference);
    const Result<DenseFigures> figures = WriteDenseFolder(
        *models[i].reconstruction, dense, photos, [&] { progress.Add(); }, FolderOf(options, i));
    std::cout << FolderOf(options, i).string() << ": ";
    const bool has_none = figures.status().code == StatusCode::kFailedPrecondition;
    if (has_none && models.size() > 1) {
      std::cout << figures.error() << std::endl;
      continue;
    }
    ThrowUnlessOk(figures.status());
    TellFigures(*figures, options);
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
  if (!options.images.empty() && options.model.empty()) return "--images is for --model";
  const bool has_photos = !options.session.empty() || !options.images.empty();
  for (const std::string& format : options.formats) {
    if ((format == kGaussianSplatting || IsDense(format)) && !has_photos) {
      return format + " needs the model's photos: give --images";
    }
  }
  return "";
}

}  // namespace

int RunExport(int argc, char** argv) {
  ExportOptions options;
  std::vector<std::string> known = ModelFormats();
  known.insert(known.end(), {kGaussianSplatting, kDatabase});
  known.insert(known.end(), std::begin(kDenseFormats), std::end(kDenseFormats));
  CLI::App app(
      "Exports a session's maps, at any time, also while it runs: OUTPUT/0 is the one with "
      "most\n"
      "photos. database: OUTPUT/database.db with features and verified matches for COLMAP.\n"
      "nerfstudio, gaussian-splatting: with undistorted photos, to be trained on as they are.\n"
      "dense: OUTPUT/N/dense.ply, the surface as points with normals and colours; las: dense.las,\n"
      "the same points; mesh: triangles, mesh.ply and textured mesh.glb; depth: a depth map of "
      "each\n"
      "photo in OUTPUT/N/depth, and in masks/ there a mask of each, black on what other photos\n"
      "contradict, as things that moved (COLMAP's mask_path).\n"
      "orthophoto: orthophoto.tif, elevation.tif and hillshade.tif, cloud optimised GeoTIFF; on\n"
      "the earth with --georeferenced, else in units of the map above its ground plane, with "
      "world\n"
      "files (.tfw).",
      "skein export");
  app.add_option("--session", options.session, "Session folder")->check(CLI::ExistingDirectory);
  app.add_option("--model", options.model, "Or: a COLMAP model folder")
      ->check(CLI::ExistingDirectory);
  app.add_option("--images", options.images,
                 "Folder of the photos of --model, by their names there")
      ->check(CLI::ExistingDirectory);
  app.add_option("--output", options.output, "Folder to write into");
  app.add_option("--format", options.formats, "One or more, separated by commas")
      ->delimiter(',')
      ->check(CLI::IsMember(known))
      ->capture_default_str();
  app.add_option("--depth-size", options.depth_size_px,
                 "Longer side of the depth maps, pixels; half of it takes a quarter of the time")
      ->check(CLI::Range(100, 2048))
      ->capture_default_str();
  app.add_option("--mesh-triangles", options.mesh_triangles,
                 "At most so many; beyond them the mesh gets coarser")
      ->check(CLI::Range(kLeastTriangles, kMostTriangles))
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
  const bool database = Has(options, kDatabase);
  if (const std::string wrong = CheckOptions(options, database); !wrong.empty()) {
    std::cerr << "skein export: " << wrong << "\n";
    return kExitUsage;
  }
  if (database && !options.output.empty()) ExportDatabase(options);
  const bool only_training = PlainFormats(options).empty() && !database;
  if (!options.session.empty() && !options.output.empty() && !only_training) {
    ExportUnmirrored(options);
  }
  const bool only_database = database && options.formats.size() == 1;
  if (only_database && options.picture.empty()) return kExitOk;

  std::vector<ExportModel> models = ReadModels(options);
  if (models.empty()) throw std::runtime_error("the session has no model yet");
  if (options.georeferenced) PlaceModels(options, &models);
  if (!options.output.empty() && !only_database) {
    WriteModels(models, options);
    if (!TrainingFormats(options).empty()) WriteTrainingFolders(models, options);
    if (!FormatsOfKind(options, IsDense).empty()) WriteDenseFolders(models, options);
  }
  if (!options.picture.empty()) WritePicture(*models.front().reconstruction, options.picture);
  return kExitOk;
}

}  // namespace skein
