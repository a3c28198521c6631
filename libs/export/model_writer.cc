#include "export/model_writer.h"

#include <functional>
#include <utility>

#include "export/nerfstudio.h"
#include "export/nvm.h"
#include "export/points_ply.h"
#include "export/simple_camera.h"
#include "export/written_names.h"
#include "geometry/model_poses.h"

namespace skein {
namespace {

namespace fs = std::filesystem;

using Writer = std::function<Status(const colmap::Reconstruction&, const fs::path&)>;

Status NotWhole(const fs::path& path) {
  return Unavailable("could not write all of " + path.string() + " (is the disk full?)");
}

Status ExpectContent(const fs::path& path, uintmax_t at_least) {
  std::error_code error;
  const uintmax_t size = fs::file_size(path, error);
  return error || size < at_least ? NotWhole(path) : Status::Ok();
}

// Reads the poses and points back and counts them.
Status ExpectModel(const colmap::Reconstruction& model, const fs::path& folder) {
  const Result<ModelPoses> written = ReadColmapPoses(folder);
  if (!written) return written.status();
  if (written->poses.size() != model.NumRegImages() ||
      written->points.points != model.NumPoints3D()) {
    return NotWhole(folder);
  }
  return Status::Ok();
}

// In a folder of its own first: ReadColmapPoses would prefer binary files beside the text.
Status WriteText(const colmap::Reconstruction& model, const fs::path& folder) {
  const fs::path partial = folder / "text.part";
  fs::create_directories(partial);
  model.WriteText(partial.string());
  const Status whole = ExpectModel(model, partial);
  if (whole.ok()) {
    for (const char* name : {"cameras.txt", "images.txt", "points3D.txt"}) {
      fs::rename(partial / name, folder / name);
    }
  }
  fs::remove_all(partial);
  return whole;
}

Status WriteBinary(const colmap::Reconstruction& model, const fs::path& folder) {
  model.WriteBinary(folder.string());
  return ExpectModel(model, folder);
}

Status WritePly(const colmap::Reconstruction& model, const fs::path& folder) {
  return WritePointsPly(model, folder / "points.ply");
}

Status WriteNerfstudioOfStored(const colmap::Reconstruction& model, const fs::path& folder) {
  return WriteNerfstudio(model, folder, [](const colmap::Image& image) {
    return NerfstudioFiles{"images/" + image.Name(), ""};
  });
}

// Calls `write` with the model, its photos renamed if blanks would part their names.
Status WithReadableNames(const colmap::Reconstruction& model, const fs::path& names_file,
                         const std::function<Status(const colmap::Reconstruction&)>& write) {
  if (NumNamesWithBlanks(model) == 0) return write(model);
  const WrittenNames names = NamesWithoutBlanks(model);
  colmap::Reconstruction renamed = model;
  RenameImages(names, &renamed);
  const Status written = write(renamed);
  return written.ok() ? WriteNames(model, names, names_file) : written;
}

Status WriteBundler(const colmap::Reconstruction& model, const fs::path& folder) {
  for (const auto& [id, camera] : model.Cameras()) {
    if (Status simple = ExpectSimpleCamera(camera, "bundler"); !simple.ok()) return simple;
  }
  const fs::path path = folder / "bundle.out", list = folder / "bundle.out.list.txt";
  return WithReadableNames(model, folder / "bundle.out.names.txt", [&](const auto& readable) {
    if (!readable.ExportBundler(path.string(), list.string())) return NotWhole(path);
    const Status whole = ExpectContent(path, 1 + 20 * readable.NumPoints3D());
    return whole.ok() ? ExpectContent(list, 1) : whole;
  });
}

Status WriteNvm(const colmap::Reconstruction& model, const fs::path& folder) {
  return WithReadableNames(model, folder / "model.nvm.names.txt", [&](const auto& readable) {
    return WriteNvmFile(readable, folder / "model.nvm");
  });
}

Status WriteReadableText(const colmap::Reconstruction& model, const fs::path& folder) {
  return WithReadableNames(model, folder / "text.names.txt",
                           [&](const auto& readable) { return WriteText(readable, folder); });
}

const std::vector<std::pair<std::string, Writer>>& Writers() {
  static const std::vector<std::pair<std::string, Writer>> writers = {
      {"bin", WriteBinary},      {"text", WriteReadableText},
      {"ply", WritePly},         {"nerfstudio", WriteNerfstudioOfStored},
      {"bundler", WriteBundler}, {"nvm", WriteNvm}};
  return writers;
}

}  // namespace

const std::vector<std::string>& ModelFormats() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all;
    for (const auto& writer : Writers()) all.push_back(writer.first);
    return all;
  }();
  return names;
}

Status WriteModel(const colmap::Reconstruction& model, const std::string& format,
                  const fs::path& folder) {
  for (const auto& [name, write] : Writers()) {
    if (name == format) return write(model, folder);
  }
  return InvalidArgument("there is no format '" + format + "'");
}

bool PartsNamesAtBlanks(const std::string& format) {
  return format == "text" || format == "bundler" || format == "nvm";
}

}  // namespace skein
