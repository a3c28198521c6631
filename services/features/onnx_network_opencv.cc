#include <opencv2/dnn.hpp>
#include <utility>

#include "features/onnx_file.h"
#include "features/onnx_network.h"

namespace skein {
namespace {

class OpenCvNetwork : public OnnxNetwork {
 public:
  OpenCvNetwork(const Bytes& model, OnnxFile file) : model_(model), file_(std::move(file)) {}

  const std::vector<OnnxValueInfo>& inputs() const override { return file_.inputs; }
  const std::vector<OnnxValueInfo>& outputs() const override { return file_.outputs; }

  Result<OnnxTensor> Run(OnnxTensor input, const std::string& output) override {
    try {
      if (net_.empty()) ReadNet();
      const std::vector<int> shape(input.shape.begin(), input.shape.end());
      net_.setInput(cv::Mat(shape, CV_32F, input.values.data()));
      return ToTensor(output.empty() ? net_.forward() : net_.forward(output));
    } catch (const cv::Exception& e) {
      return InvalidArgument("cannot be run by OpenCV (opset " + std::to_string(file_.opset) +
                             "): " + e.err.substr(0, e.err.find('\n')) + HowToExport());
    }
  }

 private:
  // At the first Run: the caller checks inputs() before, of which OpenCV's errors say less.
  void ReadNet() {
    const Bytes model = std::exchange(model_, {});
    net_ = cv::dnn::readNetFromONNX(model);
    net_.setPreferableBackend(cv::dnn::DNN_BACKEND_OPENCV);
    net_.setPreferableTarget(cv::dnn::DNN_TARGET_CPU);
  }

  static OnnxTensor ToTensor(const cv::Mat& output) {
    OnnxTensor tensor{{output.size.p, output.size.p + output.dims}, {}};
    output.reshape(1, 1).convertTo(tensor.values, CV_32F);
    return tensor;
  }

  Bytes model_;  // empty from the first Run on
  OnnxFile file_;
  cv::dnn::Net net_;
};

}  // namespace

Result<std::unique_ptr<OnnxNetwork>> ReadOnnxNetwork(const Bytes& model) {
  auto file = ReadOnnxFile(model);
  if (!file) return file.status();
  return std::unique_ptr<OnnxNetwork>(std::make_unique<OpenCvNetwork>(model, *std::move(file)));
}

std::string HowToExport() {
  return "; export it with torch.onnx.export(model.eval(), torch.zeros(1, 3, 512, 512), "
         "\"model.onnx\", opset_version=10)";
}

}  // namespace skein
