#include "ingest/model_writer.h"

#include <fcntl.h>
#include <stdio.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>

#include "blobs/blob_store.h"
#include "core/file.h"
#include "formats/formats.h"

namespace skein {
namespace {

namespace fs = std::filesystem;

constexpr const char* kModelFiles[] = {"cameras.bin", "images.bin", "points3D.bin"};

Status WriteModel(const BlobStore& store, const std::string& blob_id, const fs::path& dir) {
  const Result<Bytes> bytes = store.Get(blob_id);
  if (!bytes.ok()) return bytes.status();
  const Result<ModelArchive> archive = DecodeModelArchive(*bytes);
  if (!archive.ok()) return archive.status().Within("model " + blob_id);
  fs::create_directories(dir);
  for (const char* name : kModelFiles) {
    const auto file = archive->find(name);
    if (file == archive->end()) return DataLoss("model " + blob_id + " lacks " + name);
    const Status status = WriteFileAtomic((dir / name).string(), file->second);
    if (!status.ok()) return status;
  }
  return Status::Ok();
}

Status WriteAll(const SessionPaths& paths, const std::vector<std::string>& model_blobs,
                const fs::path& dir) {
  const BlobStore store(paths.Blobs());
  fs::remove_all(dir);
  fs::create_directories(dir);
  for (size_t i = 0; i < model_blobs.size(); ++i) {
    const Status status = WriteModel(store, model_blobs[i], dir / std::to_string(i));
    if (!status.ok()) return status;
  }
  return Status::Ok();
}

// Puts `fresh` in the place of `dir` in one step where the kernel can (Linux), else in two.
void Replace(const fs::path& fresh, const fs::path& dir) {
  if (fs::exists(dir) &&
      renameat2(AT_FDCWD, fresh.c_str(), AT_FDCWD, dir.c_str(), RENAME_EXCHANGE) == 0) {
    fs::remove_all(fresh);
    return;
  }
  fs::remove_all(dir);
  fs::rename(fresh, dir);
}

}  // namespace

Status WriteModels(const SessionPaths& paths, const std::vector<std::string>& model_blobs) {
  const fs::path fresh = paths.root / "sparse.new";
  try {
    if (Status status = WriteAll(paths, model_blobs, fresh); !status.ok()) return status;
    Replace(fresh, paths.Sparse());
  } catch (const fs::filesystem_error& error) {
    return Unavailable(error.what());
  }
  return Status::Ok();
}

}  // namespace skein
