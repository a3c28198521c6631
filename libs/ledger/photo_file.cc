#include "ledger/photo_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <system_error>

#include "blobs/blob_store.h"
#include "core/file.h"

namespace skein {
namespace {

namespace fs = std::filesystem;

Status SyncFolder(const fs::path& dir) {
  const int fd = open(dir.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  const bool synced = fd >= 0 && fsync(fd) == 0;
  if (fd >= 0) close(fd);
  return synced ? Status::Ok() : Unavailable("cannot sync " + dir.string());
}

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

// Goes down only: no root, no "..", at least one name.
bool LeadsDown(const fs::path& path) {
  return path.is_relative() && path.has_filename() &&
         std::none_of(path.begin(), path.end(),
                      [](const fs::path& part) { return part == ".." || part == "."; });
}

}  // namespace

Status StorePhoto(const SessionPaths& paths, const std::string& agent, const std::string& name,
                  const Bytes& bytes) {
  if (!LeadsDown(agent) || fs::path(agent).has_parent_path() || !LeadsDown(name)) {
    return InvalidArgument("unsafe name of a photo: " + agent + "/" + name);
  }
  BlobStore store(paths.Blobs());
  const Result<std::string> blob_id = store.Put(bytes);
  if (!blob_id.ok()) return blob_id.status();
  const fs::path path = paths.Image(agent, name);
  std::error_code error;
  fs::create_directories(path.parent_path(), error);
  if (error) {
    return Unavailable("cannot create " + path.parent_path().string() + ": " + error.message());
  }
  return LinkAs(store.Path(*blob_id), path, bytes);
}

}  // namespace skein
