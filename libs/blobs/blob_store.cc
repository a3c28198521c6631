#include "blobs/blob_store.h"

#include <fcntl.h>
#include <unistd.h>

#include <stdexcept>
#include <system_error>

#include "core/file.h"
#include "core/hash.h"

namespace skein {

namespace fs = std::filesystem;

namespace {

// A new folder's entry lies in its parent. The parent must be synced to survive power loss.
Status CreateDurably(const fs::path& dir) {
  std::error_code error;
  if (!fs::create_directories(dir, error) && !error) return Status::Ok();
  if (error) return Unavailable("cannot create " + dir.string() + ": " + error.message());
  const int parent = open(dir.parent_path().c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  const bool synced = parent >= 0 && fsync(parent) == 0;
  if (parent >= 0) close(parent);
  return synced ? Status::Ok() : Unavailable("cannot sync " + dir.parent_path().string());
}

}  // namespace

BlobStore::BlobStore(fs::path dir) : dir_(std::move(dir)) {}

Result<std::string> BlobStore::Put(const Bytes& bytes) {
  const std::string blob_id = HashBytes(bytes.data(), bytes.size());
  if (Get(blob_id).ok()) return blob_id;
  const fs::path path = Path(blob_id);
  if (Status status = CreateDurably(path.parent_path()); !status.ok()) return status;
  if (Status status = WriteFileAtomic(path.string(), bytes); !status.ok()) return status;
  return blob_id;
}

bool BlobStore::Has(const std::string& blob_id) const {
  std::error_code error;
  return IsBlobId(blob_id) && fs::is_regular_file(Path(blob_id), error);
}

Result<Bytes> BlobStore::Get(const std::string& blob_id) const {
  if (!IsBlobId(blob_id)) return InvalidArgument("not a blob id: '" + blob_id + "'");
  if (!Has(blob_id)) return NotFound("no blob " + blob_id);
  Result<Bytes> bytes = ReadFile(Path(blob_id).string());
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
