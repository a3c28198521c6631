#include <onnxruntime_cxx_api.h>

#include <iostream>
#include <utility>

#include "features/onnx_network.h"

namespace skein {
namespace {

constexpr char kHowToJoin[] =
    "keeps its weights in another file: put all into one with onnx.save(onnx.load(\"model.onnx\"), "
    "\"one.onnx\")";
// Version 1.21 says so of a model in memory whose weights are in another file.
constexpr char kNoPath[] = "model_path must not be empty";

// Discards std::cerr. Debian's library 1.21 registers each operator twice, which libonnx tells
// there in 567 lines at the first session (github.com/microsoft/onnxruntime/pull/32353).
class SilentCerr {
 public:
  SilentCerr() { std::cerr.setstate(std::ios::failbit); }
  ~SilentCerr() { std::cerr.clear(state_); }
  SilentCerr(const SilentCerr&) = delete;
  SilentCerr& operator=(const SilentCerr&) = delete;

 private:
  const std::ios::iostate state_ = std::cerr.rdstate();
};

// One thread, so that workers share the cores among them and sums keep their order. Errors come as
// exceptions; the library's log would only repeat them.
Ort::SessionOptions OneThread() {
  Ort::SessionOptions options;
  options.SetIntraOpNumThreads(1);
  options.SetInterOpNumThreads(1);
  options.SetExecutionMode(ORT_SEQUENTIAL);
  options.SetDeterministicCompute(true);
  options.SetLogSeverityLevel(ORT_LOGGING_LEVEL_FATAL);
  return options;
}

// Throws Ort::Exception.
Ort::Session OpenSession(const Ort::Env& env, const Bytes& model) {
  const SilentCerr silent;
  return Ort::Session(env, model.data(), model.size(), OneThread());
}

std::string FirstLine(const std::string& text) {
  const std::string line = text.substr(0, text.find('\n'));
  return line.substr(0, line.find_last_not_of(". ") + 1);
}

Status CannotRun(const Ort::Exception& error) {
  const std::string text = error.what();
  if (error.GetOrtErrorCode() == ORT_INVALID_PROTOBUF) {
    return InvalidArgument("is no ONNX model, or damaged");
  }
  if (text.find(kNoPath) != std::string::npos) return InvalidArgument(kHowToJoin);
  return InvalidArgument("cannot be run by ONNX Runtime " + Ort::GetVersionString() + ": " +
                         FirstLine(text) + HowToExport());
}

OnnxValueInfo ReadInfo(const std::string& name, const Ort::TypeInfo& type) {
  OnnxValueInfo info{name, {}};
  if (type.GetONNXType() != ONNX_TYPE_TENSOR) return info;
  for (const int64_t size : type.GetTensorTypeAndShapeInfo().GetShape()) {
    info.shape.push_back(size > 0 ? size : -1);
  }
  return info;
}

class RuntimeNetwork : public OnnxNetwork {
 public:
  // Throws Ort::Exception.
  explicit RuntimeNetwork(const Bytes& model)
      : env_(ORT_LOGGING_LEVEL_FATAL, "skein"), session_(OpenSession(env_, model)) {
    for (size_t i = 0; i < session_.GetInputCount(); ++i) {
      const auto name = session_.GetInputNameAllocated(i, allocator_);
      inputs_.push_back(ReadInfo(name.get(), session_.GetInputTypeInfo(i)));
    }
    for (size_t i = 0; i < session_.GetOutputCount(); ++i) {
      const auto name = session_.GetOutputNameAllocated(i, allocator_);
      outputs_.push_back(ReadInfo(name.get(), session_.GetOutputTypeInfo(i)));
    }
  }

  const std::vector<OnnxValueInfo>& inputs() const override { return inputs_; }
  const std::vector<OnnxValueInfo>& outputs() const override { return outputs_; }

  Result<OnnxTensor> Run(OnnxTensor input, const std::string& output) override {
    try {
      return ToTensor(RunSession(&input, output));
    } catch (const Ort::Exception& error) {
      return CannotRun(error);
    }
  }

 private:
  Ort::Value RunSession(OnnxTensor* input, const std::string& output) {
    const char* const input_name = inputs_.front().name.c_str();
    const std::string& chosen = output.empty() ? outputs_.back().name : output;
    const char* const output_name = chosen.c_str();
    const auto memory = Ort::MemoryInfo::CreateCpu(OrtArenaAllocator, OrtMemTypeDefault);
    const Ort::Value value =
        Ort::Value::CreateTensor<float>(memory, input->values.data(), input->values.size(),
                                        input->shape.data(), input->shape.size());
    return std::move(
        session_.Run(Ort::RunOptions{nullptr}, &input_name, &value, 1, &output_name, 1).front());
  }

  static Result<OnnxTensor> ToTensor(const Ort::Value& value) {
    if (!value.IsTensor()) return InvalidArgument("puts out no tensor" + HowToExport());
    const auto info = value.GetTensorTypeAndShapeInfo();
    if (info.GetElementType() != ONNX_TENSOR_ELEMENT_DATA_TYPE_FLOAT) {
      return InvalidArgument("puts out no 32-bit floats" + HowToExport());
    }
    const float* values = value.GetTensorData<float>();
    return OnnxTensor{info.GetShape(), {values, values + info.GetElementCount()}};
  }

  Ort::Env env_;  // outlives the session
  Ort::AllocatorWithDefaultOptions allocator_;
  Ort::Session session_;
  std::vector<OnnxValueInfo> inputs_;
  std::vector<OnnxValueInfo> outputs_;
};

}  // namespace

Result<std::unique_ptr<OnnxNetwork>> ReadOnnxNetwork(const Bytes& model) {
  try {
    return std::unique_ptr<OnnxNetwork>(std::make_unique<RuntimeNetwork>(model));
  } catch (const Ort::Exception& error) {
    return CannotRun(error);
  }
}

std::string HowToExport() {
  return "; export it with torch.onnx.export(model.float().eval(), torch.zeros(1, 3, 512, 512), "
         "\"model.onnx\", opset_version=18)";
}

}  // namespace skein
