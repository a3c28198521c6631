#pragma once

#include <array>
#include <memory>
#include <opencv2/core.hpp>
#include <string>

#include "core/result.h"
#include "features/global_descriptor.h"
#include "features/onnx_network.h"

namespace skein {

// How a photo becomes the network's input, 1 x 3 x height x width float: (pixel / 255 - mean) /
// std, channels in `channel_order`. The photo is stretched to the size.
struct OnnxOptions {
  int width_px = 0;  // 0: what the model says
  int height_px = 0;
  std::array<double, 3> mean{0.485, 0.456, 0.406};  // in channel order; torchvision's
  std::array<double, 3> std{0.229, 0.224, 0.225};
  std::string channel_order = "RGB";  // or "BGR"
  std::string output;                 // name of the output; "": the network's last
};

// Reads {"width": .., "height": .., "mean": [3], "std": [3], "channel_order": "..", "output":
// ".."}; absent keys leave `options` as they are. Unknown keys and wrong types are errors.
Status ReadOnnxOptions(const std::string& json_text, OnnxOptions* options);

// A learned descriptor: an ONNX model that maps an image, 1 x 3 x height x width, to a vector.
// OnnxNetwork runs the model on the CPU. The paper uses a NetVLAD-style network (Hou et al. 2023).
// The model gets the upright view.
class OnnxModel : public GlobalDescriptorModel {
 public:
  // Loads the model and runs it once. An error says why it cannot be used and what to do. Refused
  // are a size that neither the model nor `options` say, a size other than the model's, an output
  // that is no vector, and means or deviations of 0..255.
  static Result<std::shared_ptr<OnnxModel>> Load(const std::string& path,
                                                 const OnnxOptions& options);

  const std::string& id() const override { return id_; }
  int dim() const override { return dim_; }
  // Throws std::runtime_error if the network fails, as it did not in Load.
  std::vector<float> Describe(const DescribedPhoto& photo) override;

 private:
  OnnxModel(std::string id, const OnnxOptions& options, std::unique_ptr<OnnxNetwork> network);
  Status MeasureDim();
  Result<OnnxTensor> Run(const cv::Mat& upright_bgr);

  std::string id_;
  OnnxOptions options_;
  std::unique_ptr<OnnxNetwork> network_;
  int dim_ = 0;
};

}  // namespace skein
