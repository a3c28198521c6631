#pragma once

// Data of the session's state that matching uses: each photo's camera and feature blobs, its
// candidates, and who came before whom. Loop's thread only.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "session/session_state.h"
#include "sfm/camera.h"

namespace skein {

struct PhotoEntry {
  Camera camera;
  std::string keypoints_blob;
  std::string descriptors_blob;
};

class PhotoIndex {
 public:
  // `session` must outlive it.
  explicit PhotoIndex(const SessionState& session) : session_(session) {}

  // Whether the ledger was read up to the photo's candidates.
  bool HasCandidates(int64_t image_id) const;
  // Candidates whose features were known when retrieval named them, each once, without the photo
  // itself.
  std::vector<int64_t> CandidatesOf(int64_t image_id) const;

  // Whether `other_id` has features and came before `image_id`, which has, too.
  bool IsEarlier(int64_t other_id, int64_t image_id) const;

  // nullopt unless image and features are known and the camera is a possible one.
  std::optional<PhotoEntry> FindFeatures(int64_t image_id) const;

 private:
  const PhotoState* FindWithFeatures(int64_t image_id) const;

  const SessionState& session_;
};

}  // namespace skein
