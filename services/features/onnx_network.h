#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/bytes.h"
#include "core/result.h"

namespace skein {

// An input or output as the model declares it (onnx.proto: ValueInfoProto).
struct OnnxValueInfo {
  std::string name;
  std::vector<int64_t> shape;  // -1: open (dynamic)
};

struct OnnxTensor {
  std::vector<int64_t> shape;
  std::vector<float> values;  // row major
};

// An ONNX model on the CPU. CMake chooses who runs the model: ONNX Runtime where it is installed
// (onnx_network_runtime.cc, on the caller's thread alone), else OpenCV's DNN module
// (onnx_network_opencv.cc, on cv::getNumThreads() threads). One thread at a time may call.
class OnnxNetwork {
 public:
  virtual ~OnnxNetwork() = default;

  virtual const std::vector<OnnxValueInfo>& inputs() const = 0;  // weights left out
  virtual const std::vector<OnnxValueInfo>& outputs() const = 0;
  // The output of that name, "": the last, for the network's one input. An error begins with a
  // verb, as "cannot be run by ...", and says what to do.
  virtual Result<OnnxTensor> Run(OnnxTensor input, const std::string& output) = 0;
};

// Reads a model; it has an output. An error begins with a verb, as "is no ONNX model",
// and says what to do.
Result<std::unique_ptr<OnnxNetwork>> ReadOnnxNetwork(const Bytes& model);

// "; export it with ...": how PyTorch writes a model that can be run here.
std::string HowToExport();

}  // namespace skein
