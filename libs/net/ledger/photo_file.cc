#include "ledger/photo_file.h"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "blobs/blob_store.h"
#include "core/file_below.h"
#include "core/folder.h"

namespace skein {
namespace {

namespace fs = std::filesystem;

// The folders of both are below `root` without a symbolic link. Renaming onto a link of the same
// file leaves both, hence the second unlink.
Status LinkAs(const fs::path& root, const fs::path& blob, const fs::path& path,
              const Bytes& bytes) {
  const fs::path temporary = path.parent_path() / (".link.tmp-" + blob.filename().string());
  unlink(temporary.c_str());
  if (link(blob.c_str(), temporary.c_str()) != 0) return WriteFileBelow(root, path, bytes);
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
  const Status made = CreateFoldersBelow(paths.root, path.parent_path());
  if (!made.ok()) return made;
  return LinkAs(paths.root, store.Path(*blob_id), path, bytes);
}

}  // namespace skein
