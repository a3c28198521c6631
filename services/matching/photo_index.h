#pragma once

// The ledger's facts that matching needs: each photo's camera and feature blobs, its candidates,
// and verified pairs. Loop's thread only.

#include <cstdint>
#include <string>
#include <unordered_map>
#include <vector>

#include "base/camera.h"
#include "core/result.h"
#include "covisibility/covisibility.h"
#include "ledger/facts.h"

namespace skein {

struct PhotoEntry {
  colmap::Camera camera;
  std::string keypoints_blob;  // "" until the features are known
  std::string descriptors_blob;
  int64_t features_seq = 0;  // ledger position of the features: retrieval's order
};

class PhotoIndex {
 public:
  // Facts of other kinds are ignored. Returns the reason if the fact cannot be used.
  Status Take(const Fact& fact);

  // Whether the ledger was read up to the photo's candidates.
  bool HasCandidates(int64_t image_id) const { return candidates_.count(image_id) > 0; }

  // The known candidates, each once, without the photo itself. Throws std::out_of_range without
  // HasCandidates.
  const std::vector<int64_t>& CandidatesOf(int64_t image_id) const {
    return candidates_.at(image_id);
  }

  const CovisibilityGraph& covisibility() const { return covisibility_; }

  // Whether `other_id` has features and came before `image_id`, which has, too.
  bool IsEarlier(int64_t other_id, int64_t image_id) const;

  // Null unless image and features are known.
  const PhotoEntry* FindFeatures(int64_t image_id) const;

 private:
  Status TakeImage(const image_t& image);
  Status TakeFeatures(const features_t& features);
  Status TakeCandidates(const candidates_t& candidates);
  Status TakeMatches(const matches_t& matches);

  std::unordered_map<int64_t, PhotoEntry> photos_;
  std::unordered_map<int64_t, std::vector<int64_t>> candidates_;
  CovisibilityGraph covisibility_;
};

}  // namespace skein
