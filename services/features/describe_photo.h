#pragma once

#include "core/bytes.h"
#include "core/result.h"
#include "features/global_descriptor.h"
#include "features/photo_quality.h"
#include "features/sift.h"
#include "photo/photo_decoder.h"

namespace skein {

struct PhotoDescription {
  LocalFeatures local;
  GlobalDescriptor global;  // no values: nothing to describe
  PhotoQuality quality;
  double local_s = 0;  // decoding and SIFT
  double global_s = 0;
};

// A photo's bytes -> its features. Error: not a photo, or not of the size that ingest read from
// its header (0: any); kUnavailable: the photo is not to blame. `threads`: at most so many for the
// local features.
Result<PhotoDescription> DescribePhoto(PhotoDecoder* decoder, const Bytes& photo, int width_px,
                                       int height_px, int exif_orientation, SiftExtractor* sift,
                                       int threads, GlobalDescriptorModel* model);

}  // namespace skein
