// Whole files: a reader sees the old content or the new, never a part. The caller trusts each
// component of `path`; core/file_below.h is for folders that somebody else may have filled.
#pragma once

#include <limits>
#include <string>

#include "core/bytes.h"
#include "core/result.h"

namespace skein {

// Rewrites `path`: temporary name in the same folder, fsync, size check, rename, fsync of the
// folder. The folder must exist. After an error the old file, if any, is untouched. Several
// processes may write one path: the last rename wins.
Status WriteFileAtomic(const std::string& path, const void* data, size_t size);
Status WriteFileAtomic(const std::string& path, const Bytes& bytes);
Status WriteFileAtomic(const std::string& path, const std::string& text);

// Whether a file of this name is one that is still being written, or was when its process died.
bool IsTemporaryName(const std::string& name);
// A new one for `path`, beside it.
std::string TemporaryName(const std::string& path);

// The whole file; an error says which file and why. A path that is no regular file, as a FIFO, is
// refused without waiting for it. kInvalidArgument: it has more than `max_bytes`.
Result<Bytes> ReadFile(const std::string& path,
                       size_t max_bytes = std::numeric_limits<size_t>::max());
// The same of an open file, from its begin; `path` is for messages.
Result<Bytes> ReadDescriptor(int fd, const std::string& path, size_t max_bytes);

// "WHAT PATH: reason", with the code that fits to an errno.
Status FileError(const std::string& what, const std::string& path, int error);

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
