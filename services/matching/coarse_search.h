#pragma once

// Finds photos that overlap a photo, among many, by the coarsest features of each (preemptive
// matching; Wu, Towards Linear-time Incremental Structure from Motion, 2013). Matching the 1,024
// coarsest features costs a sixty-fourth of a full product. The number of mutual matches that pass
// the ratio test orders photos far better than the distance of their global descriptors.

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace skein {

class CoarseSearch {
 public:
  // Photos to be looked at.
  explicit CoarseSearch(std::vector<int64_t> image_ids) : image_ids_(std::move(image_ids)) {}

  // The next photos to look at, at most `count`; empty at the end.
  std::vector<int64_t> Take(size_t count);
  // Number of matches among the coarsest features of the photo and this one.
  void Tell(int64_t image_id, int num_matches);
  // The ten photos with most matches, most first; of as many the lower id. A photo with too few
  // for a verified pair is left out.
  std::vector<int64_t> Best() const;

 private:
  std::vector<int64_t> image_ids_;
  size_t num_taken_ = 0;
  std::vector<std::pair<int, int64_t>> told_;  // matches, photo
};

}  // namespace skein
