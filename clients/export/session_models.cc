#include "clients/export/session_models.h"

#include <stdlib.h>

#include <algorithm>
#include <functional>
#include <map>
#include <stdexcept>
#include <system_error>

#include "blobs/blob_store.h"
#include "core/file.h"
#include "formats/formats.h"
#include "geometry/model_poses.h"
#include "ledger/facts.h"
#include "ledger/ledger_store.h"

namespace skein {
namespace {

namespace fs = std::filesystem;

class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string pattern = (fs::temp_directory_path() / "skein-export-XXXXXX").string();
    if (mkdtemp(pattern.data()) == nullptr) {
      throw std::runtime_error("cannot make a folder in " + fs::temp_directory_path().string());
    }
    path_ = pattern;
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

// All facts of T, of the kind with that name, in order.
template <class T>
Status ForEachFact(const Ledger& ledger, const std::string& kind_name,
                   const std::function<void(const T&)>& take) {
  Status failure;
  const int kind = FactKindFromName(kind_name);
  const Status read = ledger.ForEach([&](const LedgerRecord& record) {
    if (record.kind != kind_name) return;
    const Result<Fact> fact = DecodeFact(kind, record.payload.data(), record.payload.size());
    if (fact) {
      take(std::get<T>(*fact));
    } else {
      failure = fact.status().Within("ledger, fact " + std::to_string(record.seq));
    }
  });
  return read.ok() ? failure : read;
}

// Newest fact with a model, of each submap that has not ended.
Result<std::vector<submap_t>> NewestModels(const Ledger& ledger) {
  std::map<int64_t, submap_t> newest;
  const Status read = ForEachFact<submap_t>(ledger, "submap", [&](const submap_t& submap) {
    if (submap.state == submap_t::ENDED) {
      newest.erase(submap.submap_id);
    } else if (!submap.model_blob.empty()) {
      newest[submap.submap_id] = submap;
    }
  });
  if (!read.ok()) return read;
  std::vector<submap_t> submaps;
  for (const auto& entry : newest) submaps.push_back(entry.second);
  std::stable_sort(submaps.begin(), submaps.end(), [](const submap_t& a, const submap_t& b) {
    return a.num_images > b.num_images;
  });
  return submaps;
}

Result<ExportModel> ReadArchive(const BlobStore& blobs, const submap_t& submap) {
  const Result<Bytes> bytes = blobs.Get(submap.model_blob);
  if (!bytes) return bytes.status();
  const Result<ModelArchive> archive = DecodeModelArchive(*bytes);
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
                 (submap.state == submap_t::FINAL ? ", final at " : ", checkpoint at ") +
                 std::to_string(submap.ledger_seq);
  return model;
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
    const Result<std::unique_ptr<Ledger>> ledger = Ledger::OpenReadOnly(paths.Ledger());
    if (!ledger) return ledger.status();
    const Result<std::vector<submap_t>> submaps = NewestModels(**ledger);
    if (!submaps) return submaps.status();
    const BlobStore blobs(paths.Blobs());
    for (const submap_t& submap : *submaps) {
      Result<ExportModel> model = ReadArchive(blobs, submap);
      if (!model) return model.status();
      models.push_back(std::move(*model));
    }
  }
  if (models.empty()) return ReadSparse(paths.Sparse());
  return models;
}

Result<std::map<std::string, GeodeticPosition>> ReadPositions(const SessionPaths& paths) {
  const Result<std::unique_ptr<Ledger>> ledger = Ledger::OpenReadOnly(paths.Ledger());
  if (!ledger) return ledger.status();
  std::map<std::string, GeodeticPosition> positions;
  const Status read =
      ForEachFact<skein::image_t>(**ledger, "image", [&](const skein::image_t& image) {
        if (!image.has_gps) return;
        positions[image.agent + "/" + image.name] = {image.latitude_deg, image.longitude_deg,
                                                     image.altitude_m};
      });
  if (!read.ok()) return read;
  return positions;
}

}  // namespace skein
