#pragma once

#include <cstdint>
#include <string>

#include "features/describe_photo.h"
#include "skein/features_t.hpp"

namespace skein {

// Ids of the encoded parts (formats/formats.h).
struct ResultBlobs {
  std::string keypoints;
  std::string descriptors;
  std::string global;
};

features_t ToMessage(int64_t image_id, int64_t computed_at_seq, const PhotoDescription& photo,
                     const ResultBlobs& blobs);

}  // namespace skein
