#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "features/sift.h"

namespace skein {

// Input of a back end.
struct DescribedPhoto {
  cv::Mat decoded;           // 8-bit BGR, unmirrored (photo/exif.h)
  int exif_orientation = 1;  // 1..8
  const LocalFeatures* features = nullptr;
};

// Maps a photo to a vector; near vectors mean overlapping photos. One thread at a time.
class GlobalDescriptorModel {
 public:
  virtual ~GlobalDescriptorModel() = default;

  // Identity of model and parameters; vectors of two ids are never compared.
  virtual const std::string& id() const = 0;
  virtual int dim() const = 0;
  // L2-normalised, dim() values; empty when the photo shows nothing that can be described.
  virtual std::vector<float> Describe(const DescribedPhoto& photo) = 0;
};

}  // namespace skein
