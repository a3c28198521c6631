#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/bytes.h"
#include "core/result.h"

namespace skein {

// Inputs and outputs of a model, as its ONNX file describes them. Read without running it.
struct OnnxTensor {
  std::string name;
  std::vector<int64_t> shape;  // -1: open (dynamic)
};

struct OnnxFile {
  int64_t opset = 0;
  std::vector<OnnxTensor> inputs;  // weights left out
  std::vector<OnnxTensor> outputs;
};

// Reads the file's protocol buffer (onnx.proto: ModelProto). An error says what the file is
// instead: a Git LFS pointer, or no ONNX model.
Result<OnnxFile> ReadOnnxFile(const Bytes& bytes);

// "1 x 3 x 224 x ?".
std::string ShapeText(const std::vector<int64_t>& shape);

}  // namespace skein
