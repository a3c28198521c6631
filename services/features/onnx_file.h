#pragma once

#include <cstdint>
#include <vector>

#include "core/bytes.h"
#include "core/result.h"
#include "features/onnx_network.h"

namespace skein {

// Inputs and outputs of a model, as its ONNX file describes them. OpenCV does not tell them; a
// build with ONNX Runtime goes without this file.
struct OnnxFile {
  int64_t opset = 0;
  std::vector<OnnxValueInfo> inputs;  // weights left out
  std::vector<OnnxValueInfo> outputs;
};

// Reads the file's protocol buffer (onnx.proto: ModelProto). An error says that it is none.
Result<OnnxFile> ReadOnnxFile(const Bytes& bytes);

}  // namespace skein
