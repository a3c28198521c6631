#pragma once

#include <filesystem>
#include <string>

#include "core/bytes.h"
#include "core/result.h"

namespace skein {

// Content-addressed files in DIR/ab/abcdef…, named by the SHA-256 of their bytes. A file is written
// under a temporary name, fsynced, checked and renamed, so a file under its final name is whole.
// Any number of processes may write and read at once. DIR and what is below it is opened as
// core/file_below.h does: no symbolic link is followed.
class BlobStore {
 public:
  explicit BlobStore(std::filesystem::path dir);  // created at the first Put

  // Returns the blob's id once it is durable. A whole blob that is there is left alone, a damaged
  // one is rewritten.
  Result<std::string> Put(const Bytes& bytes);
  bool Has(const std::string& blob_id) const;  // false for what is no id, too
  // Checks the hash; a damaged or missing blob is an error.
  Result<Bytes> Get(const std::string& blob_id) const;
  // Throws std::invalid_argument if `blob_id` is not 64 lower-case hex digits.
  std::filesystem::path Path(const std::string& blob_id) const;

 private:
  std::filesystem::path Root() const { return dir_.parent_path(); }

  std::filesystem::path dir_;
};

}  // namespace skein
