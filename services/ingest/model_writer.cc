#include "ingest/model_writer.h"

#include <fcntl.h>
#include <stdio.h>

#include <filesystem>

#include "blobs/blob_store.h"
#include "core/file_below.h"
#include "formats/formats.h"

namespace skein {
namespace {

namespace fs = std::filesystem;

// An error: it lacks a file, or cannot be read at all.
Result<ModelArchive> ReadModel(const BlobStore& store, const std::string& blob_id) {
  const Result<Bytes> bytes = store.Get(blob_id);
  if (!bytes.ok()) return bytes.status();
  Result<ModelArchive> archive = DecodeModelArchive(*bytes);
  if (!archive.ok()) return archive.status().Within("model " + blob_id);
  for (const char* name : kModelFiles) {
    if (archive->count(name) == 0) return DataLoss("model " + blob_id + " lacks " + name);
  }
  return archive;
}

Status WriteModel(const ModelArchive& archive, const fs::path& root, const fs::path& dir) {
  if (Status made = CreateFoldersBelow(root, dir); !made.ok()) return made;
  for (const char* name : kModelFiles) {
    const Status status = WriteFileBelow(root, dir / name, archive.at(name));
    if (!status.ok()) return status;
  }
  return Status::Ok();
}

WrittenModels WriteAll(const SessionPaths& paths, const std::vector<std::string>& model_blobs,
                       const fs::path& dir) {
  const BlobStore store(paths.Blobs());
  fs::remove_all(dir);  // of a symbolic link the link itself
  WrittenModels written;
  written.status = CreateFoldersBelow(paths.root, dir);
  for (size_t i = 0; i < model_blobs.size() && written.status.ok(); ++i) {
    const Result<ModelArchive> archive = ReadModel(store, model_blobs[i]);
    if (archive.ok()) {
      written.status = WriteModel(*archive, paths.root, dir / std::to_string(i));
    } else if (archive.code() == StatusCode::kUnavailable) {
      written.status = archive.status();
    } else {
      written.damaged[i] = archive.error();
    }
  }
  return written;
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

WrittenModels WriteModels(const SessionPaths& paths, const std::vector<std::string>& model_blobs) {
  const fs::path fresh = paths.root / "sparse.new";
  try {
    WrittenModels written = WriteAll(paths, model_blobs, fresh);
    if (written.ok()) Replace(fresh, paths.Sparse());
    return written;
  } catch (const fs::filesystem_error& error) {
    return {Unavailable(error.what()), {}};
  }
}

}  // namespace skein
