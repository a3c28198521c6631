#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/result.h"
#include "features/global_descriptor.h"
#include "features/onnx_descriptor.h"

namespace skein {

// Choice of the global descriptor, as the command line gives it.
struct ModelChoice {
  std::string codebook_path;  // "": the one shipped with Skein
  std::string onnx_path;      // "": VLAD
  // Over what MODEL.json beside the model says, where set.
  int width_px = 0;  // 0: not set
  int height_px = 0;
  std::string channel_order;
  std::string output;
  std::vector<double> mean;
  std::vector<double> std;

  Status Check() const;
};

// Throws std::invalid_argument, saying why and what to do, if the model cannot be used.
std::shared_ptr<GlobalDescriptorModel> LoadModel(const ModelChoice& choice);

}  // namespace skein
