#include "blobs/blob_store.h"

#include <stdexcept>
#include <system_error>

#include "core/file.h"
#include "core/folder.h"
#include "core/hash.h"

namespace skein {

namespace fs = std::filesystem;

BlobStore::BlobStore(fs::path dir) : dir_(std::move(dir)) {}

Result<std::string> BlobStore::Put(const Bytes& bytes) {
  const std::string blob_id = HashBytes(bytes.data(), bytes.size());
  if (Get(blob_id).ok()) return blob_id;
  const fs::path path = Path(blob_id);
  if (Status status = CreateFolders(path.parent_path()); !status.ok()) return status;
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
