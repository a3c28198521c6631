#pragma once

#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/bytes.h"
#include "ledger/session_folder.h"
#include "photo/photo_check.h"
#include "photo/photo_decoder.h"

namespace skein {

// Outcome of taking a photo's bytes.
struct TakenPhoto {
  enum class Outcome {
    kStored,   // durable as images/AGENT/name
    kRefused,  // no photo, or one beyond the limits: see reason
    kKnown,    // the same content was stored before, for another offer
    kFailed,   // the folder did not take it, or no decoder is there: see reason
  };
  Outcome outcome = Outcome::kFailed;
  std::string reason;
  PhotoFault fault = PhotoFault::kOther;  // of kRefused
  std::string name;                       // of kStored
  CheckedPhoto photo;                     // of kStored
};

// A file in images/ that no fact names.
struct LeftFile {
  std::string agent, name;
};

// Photos in images/ with none of these names; without temporary files.
std::vector<LeftFile> FindLeftPhotos(const SessionPaths& paths,
                                     const std::set<std::pair<std::string, std::string>>& taken);

struct LeftPhoto {
  LeftFile file;
  std::string blob_id;  // "" if it cannot be read
  Bytes bytes;
};
LeftPhoto ReadLeftPhoto(const SessionPaths& paths, const LeftFile& file);

// Takes photos into the session folder. A stored photo is expected to be committed. One thread.
class PhotoStore {
 public:
  using Names = std::set<std::pair<std::string, std::string>>;  // agent, name

  // `taken`: the names of the photos in the ledger.
  PhotoStore(SessionPaths paths, PhotoLimits limits, Names taken,
             std::unique_ptr<PhotoDecoder> decoder);

  // Checks the photo, finds a free name for it and stores it. Photos of one name from one agent are
  // all kept: NAME, NAME~2, ...
  TakenPhoto Take(const std::string& agent, const std::string& name, const std::string& blob_id,
                  const Bytes& bytes);

 private:
  std::string FreeName(const std::string& agent, const std::string& name) const;

  const SessionPaths paths_;
  const PhotoLimits limits_;
  Names taken_;
  const std::unique_ptr<PhotoDecoder> decoder_;
  std::set<std::string> contents_;  // blob ids that this object stored
};

}  // namespace skein
