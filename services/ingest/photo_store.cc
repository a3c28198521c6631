#include "ingest/photo_store.h"

#include <filesystem>
#include <utility>

#include "core/file.h"
#include "core/file_below.h"
#include "core/folder.h"
#include "core/hash.h"
#include "ledger/photo_file.h"
#include "photo/photo_check.h"
#include "photo/photo_name.h"

namespace skein {

namespace fs = std::filesystem;

namespace {

TakenPhoto Failed(const std::string& reason) {
  return {TakenPhoto::Outcome::kFailed, reason, PhotoFault::kOther, "", {}};
}

}  // namespace

std::vector<LeftFile> FindLeftPhotos(const SessionPaths& paths, const PhotoStore::Names& taken) {
  std::vector<LeftFile> left;
  for (const fs::path& file : FilesUnder(paths.Images())) {
    const fs::path path = file.lexically_relative(paths.Images());
    const std::string agent = path.begin()->string();
    const std::string name = path.lexically_relative(agent).string();
    const bool fits = CheckAgentName(agent).ok() && CheckPhotoName(name).ok();
    if (!fits || IsTemporaryName(path.filename().string())) continue;
    if (taken.count({agent, name}) == 0) left.push_back({agent, name});
  }
  return left;
}

LeftPhoto ReadLeftPhoto(const SessionPaths& paths, const LeftFile& file) {
  Result<Bytes> bytes =
      ReadFileBelow(paths.root, paths.Image(file.agent, file.name), kMaxPhotoBytes);
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
    if (photo.code() == StatusCode::kUnavailable) {
      return Failed("cannot check the photo: " + photo.error());
    }
    return {Outcome::kRefused, photo.error(), FaultOf(photo.code(), bytes), "", {}};
  }
  if (contents_.count(blob_id) > 0) return {Outcome::kKnown, "", PhotoFault::kOther, "", {}};
  const std::string free_name = FreeName(agent, name);
  const Status stored = StorePhoto(paths_, agent, free_name, bytes);
  if (!stored.ok()) return Failed("cannot store the photo: " + stored.error());
  taken_.insert({agent, free_name});
  contents_.insert(blob_id);
  return {Outcome::kStored, "", PhotoFault::kOther, free_name, *photo};
}

std::string PhotoStore::FreeName(const std::string& agent, const std::string& name) const {
  std::string candidate = name;
  for (int number = 2; taken_.count({agent, candidate}) > 0; ++number) {
    candidate = NumberedName(name, number);
  }
  return candidate;
}

}  // namespace skein
