#include "ingest/photo_store.h"

#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <utility>

#include "core/file.h"
#include "core/folder.h"
#include "core/hash.h"
#include "photo/photo_name.h"

namespace skein {
namespace {

namespace fs = std::filesystem;

// Renaming onto a link of the same file leaves both, hence the second unlink.
Status LinkAs(const fs::path& blob, const fs::path& path, const Bytes& bytes) {
  const fs::path temporary = path.parent_path() / (".link.tmp-" + blob.filename().string());
  unlink(temporary.c_str());
  if (link(blob.c_str(), temporary.c_str()) != 0) return WriteFileAtomic(path.string(), bytes);
  const int failed = rename(temporary.c_str(), path.c_str()) != 0 ? errno : 0;
  unlink(temporary.c_str());
  if (failed == 0) return SyncFolder(path.parent_path());
  return Unavailable("cannot create " + path.string() + ": " + std::strerror(failed));
}

}  // namespace

Status StorePhoto(const SessionPaths& paths, const std::string& agent, const std::string& name,
                  const Bytes& bytes) {
  if (!CheckAgentName(agent).ok() || !CheckPhotoName(name).ok()) {
    throw std::invalid_argument("unsafe name of a photo");
  }
  BlobStore store(paths.Blobs());
  const Result<std::string> blob_id = store.Put(bytes);
  if (!blob_id.ok()) return blob_id.status();
  const fs::path path = paths.Image(agent, name);
  if (Status status = CreateFolders(path.parent_path()); !status.ok()) return status;
  return LinkAs(store.Path(*blob_id), path, bytes);
}

std::vector<PhotoFile> FindLeftPhotos(const SessionPaths& paths, const PhotoStore::Names& taken) {
  std::vector<PhotoFile> left;
  std::error_code error;
  for (const auto& entry : fs::recursive_directory_iterator(paths.Images(), error)) {
    const fs::path path = fs::relative(entry.path(), paths.Images(), error);
    if (error || !entry.is_regular_file(error)) continue;
    const std::string agent = path.begin()->string();
    const std::string name = fs::relative(path, *path.begin(), error).string();
    const bool fits = CheckAgentName(agent).ok() && CheckPhotoName(name).ok();
    if (error || !fits || IsTemporaryName(path.filename().string())) continue;
    if (taken.count({agent, name}) == 0) left.push_back({agent, name});
  }
  return left;
}

LeftPhoto ReadLeftPhoto(const SessionPaths& paths, const PhotoFile& file) {
  Result<Bytes> bytes = ReadFile(paths.Image(file.agent, file.name).string());
  if (!bytes.ok()) return {file, "", {}};
  const std::string blob_id = HashBytes(bytes->data(), bytes->size());
  return {file, blob_id, *std::move(bytes)};
}

PhotoStore::PhotoStore(SessionPaths paths, PhotoLimits limits, Names taken,
                       std::unique_ptr<PhotoDecoder> decoder)
    : paths_(std::move(paths)),
      limits_(limits),
      taken_(std::move(taken)),
      decoder_(std::move(decoder)) {}

TakenPhoto PhotoStore::Take(const std::string& agent, const std::string& name,
                            const std::string& blob_id, const Bytes& bytes) {
  using Outcome = TakenPhoto::Outcome;
  const Result<CheckedPhoto> photo = decoder_->Check(bytes, limits_);
  if (!photo.ok()) {
    if (photo.code() != StatusCode::kUnavailable) return {Outcome::kRefused, photo.error(), "", {}};
    return {Outcome::kFailed, "cannot check the photo: " + photo.error(), "", {}};
  }
  if (contents_.count(blob_id) > 0) return {Outcome::kKnown, "", "", {}};
  const std::string free_name = FreeName(agent, name);
  const Status stored = StorePhoto(paths_, agent, free_name, bytes);
  if (!stored.ok()) return {Outcome::kFailed, "cannot store the photo: " + stored.error(), "", {}};
  taken_.insert({agent, free_name});
  contents_.insert(blob_id);
  return {Outcome::kStored, "", free_name, *photo};
}

std::string PhotoStore::FreeName(const std::string& agent, const std::string& name) const {
  std::string candidate = name;
  for (int number = 2; taken_.count({agent, candidate}) > 0; ++number) {
    candidate = NumberedName(name, number);
  }
  return candidate;
}

}  // namespace skein
