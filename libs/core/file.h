// Whole files: a reader sees the old content or the new, never a part.
#pragma once

#include <string>

#include "core/bytes.h"
#include "core/result.h"

namespace skein {

// Writes `path` anew: temporary name in the same folder, fsync, size check, rename, fsync of the
// folder. The folder must exist. After an error the old file, if any, is untouched. Several
// processes may write one path: the last rename wins.
Status WriteFileAtomic(const std::string& path, const void* data, size_t size);
// The same for what only its owner may read.
Status WriteSecretFile(const std::string& path, const void* data, size_t size);
Status WriteFileAtomic(const std::string& path, const Bytes& bytes);

// Whether a file of this name is one that is still being written, or was when its process died.
bool IsTemporaryName(const std::string& name);

// The whole file; an error says which file and why.
Result<Bytes> ReadFile(const std::string& path);

// Holds an exclusive lock on a folder while it lives; of one that cannot be opened, none.
class FolderLock {
 public:
  explicit FolderLock(const std::string& dir);
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int fd_;
};

}  // namespace skein
