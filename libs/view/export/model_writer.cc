#include "export/model_writer.h"

#include <functional>
#include <utility>

#include "export/bundler.h"
#include "export/nerfstudio.h"
#include "export/nvm.h"
#include "export/points_ply.h"
#include "export/written_names.h"
#include "sfm/model_files.h"

namespace skein {
namespace {

namespace fs = std::filesystem;

using Writer = std::function<Status(const Reconstruction&, const fs::path&)>;

Status WritePly(const Reconstruction& model, const fs::path& folder) {
  return WritePointsPly(model, folder / "points.ply");
}

Status WriteNerfstudioOfStored(const Reconstruction& model, const fs::path& folder) {
  return WriteNerfstudio(model, folder, [](const Image& image) {
    return NerfstudioFiles{"images/" + image.Name(), ""};
  });
}

// Calls `write` with the model, its photos renamed if blanks would part their names.
Status WithReadableNames(const Reconstruction& model, const fs::path& names_file,
                         const std::function<Status(const Reconstruction&)>& write) {
  if (NumNamesWithBlanks(model) == 0) return write(model);
  const WrittenNames names = NamesWithoutBlanks(model);
  Reconstruction renamed = model;
  RenameImages(names, &renamed);
  const Status written = write(renamed);
  return written.ok() ? WriteNames(model, names, names_file) : written;
}

Status WriteBundler(const Reconstruction& model, const fs::path& folder) {
  return WithReadableNames(model, folder / "bundle.out.names.txt", [&](const auto& readable) {
    return WriteBundlerFiles(readable, folder / "bundle.out", folder / "bundle.out.list.txt");
  });
}

Status WriteNvm(const Reconstruction& model, const fs::path& folder) {
  return WithReadableNames(model, folder / "model.nvm.names.txt", [&](const auto& readable) {
    return WriteNvmFile(readable, folder / "model.nvm");
  });
}

Status WriteReadableText(const Reconstruction& model, const fs::path& folder) {
  return WithReadableNames(model, folder / "text.names.txt",
                           [&](const auto& readable) { return WriteModelText(readable, folder); });
}

const std::vector<std::pair<std::string, Writer>>& Writers() {
  static const std::vector<std::pair<std::string, Writer>> writers = {
      {"bin", WriteModelBinary}, {"text", WriteReadableText},
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

Status WriteModel(const Reconstruction& model, const std::string& format, const fs::path& folder) {
  for (const auto& [name, write] : Writers()) {
    if (name == format) return write(model, folder);
  }
  return InvalidArgument("there is no format '" + format + "'");
}

bool PartsNamesAtBlanks(const std::string& format) {
  return format == "text" || format == "bundler" || format == "nvm";
}

}  // namespace skein
