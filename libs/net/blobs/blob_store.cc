#include "blobs/blob_store.h"

#include <stdexcept>

#include "core/file_below.h"
#include "core/folder.h"
#include "core/hash.h"

namespace skein {

namespace fs = std::filesystem;

namespace {

// A photo has 200 MB at most by default, a model of 10,000 photos some 2 GB.
constexpr size_t kMaxBlobBytes = size_t{16} << 30;

}  // namespace

BlobStore::BlobStore(fs::path dir) : dir_(std::move(dir)) {}

Result<std::string> BlobStore::Put(const Bytes& bytes) {
  const std::string blob_id = HashBytes(bytes.data(), bytes.size());
  if (Get(blob_id).ok()) return blob_id;
  const fs::path path = Path(blob_id);
  if (Status status = CreateFolders(Root()); !status.ok()) return status;
  if (Status status = CreateFoldersBelow(Root(), path.parent_path()); !status.ok()) return status;
  if (Status status = WriteFileBelow(Root(), path, bytes); !status.ok()) return status;
  return blob_id;
}

bool BlobStore::Has(const std::string& blob_id) const {
  return IsBlobId(blob_id) && IsFileBelow(Root(), Path(blob_id));
}

Result<Bytes> BlobStore::Get(const std::string& blob_id) const {
  if (!IsBlobId(blob_id)) return InvalidArgument("not a blob id: '" + blob_id + "'");
  Result<Bytes> bytes = ReadFileBelow(Root(), Path(blob_id), kMaxBlobBytes);
  if (bytes.code() == StatusCode::kNotFound) return NotFound("no blob " + blob_id);
  if (bytes.ok() && HashBytes(bytes->data(), bytes->size()) != blob_id) {
    return DataLoss("blob " + blob_id + " is damaged on disk");
  }
  return bytes;
}

fs::path BlobStore::Path(const std::string& blob_id) const {
  if (!IsBlobId(blob_id)) throw std::invalid_argument("not a blob id: '" + blob_id + "'");
  return dir_ / blob_id.substr(0, 2) / blob_id;
}

}  // namespace skein
