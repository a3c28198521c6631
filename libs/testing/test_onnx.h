// ONNX models for tests, written without a library.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace skein {

// Writes a model as a protocol buffer (onnx.proto: ModelProto). Each node is named by its output.
class TestOnnx {
 public:
  explicit TestOnnx(int opset) : opset_(opset) {}

  // Float tensors; a dimension of -1 is open.
  TestOnnx& Input(const std::string& name, const std::vector<int64_t>& shape) {
    graph_ += Text(11, ValueInfo(name, shape, kFloat));
    return *this;
  }
  TestOnnx& Output(const std::string& name, const std::vector<int64_t>& shape) {
    graph_ += Text(12, ValueInfo(name, shape, kFloat));
    return *this;
  }
  TestOnnx& OutputOfIntegers(const std::string& name, const std::vector<int64_t>& shape) {
    graph_ += Text(12, ValueInfo(name, shape, kInt64));
    return *this;
  }
  TestOnnx& Node(const std::string& op, const std::vector<std::string>& inputs,
                 const std::string& output, const std::string& attributes = "") {
    std::string node;
    for (const std::string& input : inputs) node += Text(1, input);
    graph_ += Text(1, node + Text(2, output) + Text(3, output) + Text(4, op) + attributes);
    return *this;
  }
  // One-dimensional.
  TestOnnx& Weights(const std::string& name, const std::vector<float>& values) {
    graph_ += Text(5, Int(1, values.size()) + Int(2, kFloat) + Text(8, name) + Raw(values));
    return *this;
  }
  TestOnnx& Weights(const std::string& name, const std::vector<int64_t>& values) {
    graph_ += Text(5, Int(1, values.size()) + Int(2, kInt64) + Text(8, name) + Raw(values));
    return *this;
  }
  // `size` floats in the file `location` beside the model.
  TestOnnx& WeightsElsewhere(const std::string& name, size_t size, const std::string& location) {
    const std::string data = Text(13, Text(1, "location") + Text(2, location)) + Int(14, 1);
    graph_ += Text(5, Int(1, size) + Int(2, kFloat) + Text(8, name) + data);
    return *this;
  }
  // An attribute of a node.
  static std::string Attribute(const std::string& name, int64_t value) {
    return Text(5, Text(1, name) + Int(3, value) + Int(20, 2));
  }

  std::string Model() const {
    constexpr int kIrVersion = 8;
    return Int(1, kIrVersion) + Text(7, graph_ + Text(2, "test")) +
           Text(8, Text(1, "") + Int(2, opset_));
  }

 private:
  enum ElementType { kFloat = 1, kInt64 = 7 };

  static std::string Varint(uint64_t value) {
    std::string out;
    for (; value >= 0x80; value >>= 7) out += static_cast<char>((value & 0x7f) | 0x80);
    return out + static_cast<char>(value);
  }
  static std::string Int(int field, uint64_t value) { return Varint(field << 3) + Varint(value); }
  static std::string Text(int field, const std::string& value) {
    return Varint(field << 3 | 2) + Varint(value.size()) + value;
  }
  template <class T>
  static std::string Raw(const std::vector<T>& values) {
    const auto* bytes = reinterpret_cast<const char*>(values.data());
    return Text(9, {bytes, values.size() * sizeof(T)});
  }
  static std::string ValueInfo(const std::string& name, const std::vector<int64_t>& shape,
                               ElementType type) {
    std::string dims;
    for (const int64_t size : shape) dims += Text(1, size < 0 ? Text(2, "open") : Int(1, size));
    return Text(1, name) + Text(2, Text(1, Int(1, type) + Text(2, dims)));
  }

  int opset_;
  std::string graph_;
};

}  // namespace skein
