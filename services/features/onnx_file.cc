#include "features/onnx_file.h"

#include <algorithm>
#include <set>
#include <stdexcept>
#include <string_view>

namespace skein {
namespace {

// Field numbers of onnx.proto.
enum ModelField { kGraph = 7, kOpsetImport = 8 };
enum OpsetField { kOpsetVersion = 2 };
enum GraphField { kInitializer = 5, kInput = 11, kOutput = 12 };
enum InitializerField { kInitializerName = 8 };
enum ValueField { kValueName = 1, kValueType = 2 };
enum TypeField { kTensorType = 1 };
enum TensorField { kTensorShape = 2 };
enum ShapeField { kShapeDim = 1 };
enum DimField { kDimValue = 1 };

// A field of a protocol buffer: a number, or the bytes of a text or a message.
struct Field {
  int number = 0;
  uint64_t value = 0;
  std::string_view bytes;
};

// Goes through the fields of a message. Throws std::runtime_error where it is damaged.
class Fields {
 public:
  explicit Fields(std::string_view message) : rest_(message) {}

  bool Next(Field* field) {
    if (rest_.empty()) return false;
    const uint64_t tag = Varint();
    *field = {static_cast<int>(tag >> 3), 0, {}};
    switch (tag & 7) {
      case 0:
        field->value = Varint();
        return true;
      case 1:
        Take(8);
        return true;
      case 2:
        field->bytes = Take(Varint());
        return true;
      case 5:
        Take(4);
        return true;
      default:
        throw std::runtime_error("no such wire type");
    }
  }

 private:
  uint64_t Varint() {
    uint64_t value = 0;
    for (int shift = 0; shift < 64; shift += 7) {
      const auto byte = static_cast<uint8_t>(Take(1)[0]);
      value |= static_cast<uint64_t>(byte & 0x7f) << shift;
      if ((byte & 0x80) == 0) return value;
    }
    throw std::runtime_error("a number without end");
  }

  std::string_view Take(uint64_t size) {
    if (size > rest_.size()) throw std::runtime_error("ends too early");
    const std::string_view taken = rest_.substr(0, size);
    rest_.remove_prefix(size);
    return taken;
  }

  std::string_view rest_;
};

// Calls visit(field) for each field of that number.
template <class Visit>
void ForEach(std::string_view message, int number, Visit visit) {
  Fields fields(message);
  for (Field field; fields.Next(&field);) {
    if (field.number == number) visit(field);
  }
}

int64_t ReadDim(std::string_view dim) {
  int64_t size = -1;  // a name, or nothing: open
  ForEach(dim, kDimValue, [&](const Field& f) { size = static_cast<int64_t>(f.value); });
  return size > 0 ? size : -1;
}

OnnxValueInfo ReadValueInfo(std::string_view value) {
  OnnxValueInfo info;
  ForEach(value, kValueName, [&](const Field& f) { info.name = f.bytes; });
  ForEach(value, kValueType, [&](const Field& type) {
    ForEach(type.bytes, kTensorType, [&](const Field& t) {
      ForEach(t.bytes, kTensorShape, [&](const Field& shape) {
        ForEach(shape.bytes, kShapeDim,
                [&](const Field& d) { info.shape.push_back(ReadDim(d.bytes)); });
      });
    });
  });
  return info;
}

void ReadGraph(std::string_view graph, OnnxFile* file) {
  std::set<std::string> weights;  // older exporters name them among the inputs, too
  ForEach(graph, kInitializer, [&](const Field& weight) {
    ForEach(weight.bytes, kInitializerName, [&](const Field& f) { weights.emplace(f.bytes); });
  });
  ForEach(graph, kInput, [&](const Field& f) {
    OnnxValueInfo input = ReadValueInfo(f.bytes);
    if (weights.count(input.name) == 0) file->inputs.push_back(std::move(input));
  });
  ForEach(graph, kOutput, [&](const Field& f) { file->outputs.push_back(ReadValueInfo(f.bytes)); });
}

}  // namespace

Result<OnnxFile> ReadOnnxFile(const Bytes& bytes) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  OnnxFile file;
  try {
    ForEach(text, kGraph, [&](const Field& graph) { ReadGraph(graph.bytes, &file); });
    ForEach(text, kOpsetImport, [&](const Field& import) {
      ForEach(import.bytes, kOpsetVersion, [&](const Field& f) {
        file.opset = std::max(file.opset, static_cast<int64_t>(f.value));
      });
    });
  } catch (const std::runtime_error&) {
    return InvalidArgument("is no ONNX model, or damaged");
  }
  if (file.outputs.empty()) return InvalidArgument("is no ONNX model, or damaged");
  return file;
}

}  // namespace skein
