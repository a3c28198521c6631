#include "features/onnx_descriptor.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <opencv2/dnn.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>
#include <utility>

#include "core/file.h"
#include "core/hash.h"
#include "features/onnx_file.h"
#include "photo/image_view.h"

namespace skein {
namespace {

constexpr int kMaxSizePx = 8192;

std::string Text(double value) {
  std::ostringstream text;
  text << value;
  return text.str();
}

constexpr char kHowToExport[] =
    "; export it with torch.onnx.export(model, torch.zeros(1, 3, 512, 512), \"model.onnx\", "
    "opset_version=10)";
constexpr double kMaxMean = 1;  // of pixel / 255
constexpr double kMaxStd = 10;

Status CheckScale(const OnnxOptions& options) {
  for (const double mean : options.mean) {
    if (!(std::abs(mean) <= kMaxMean)) {
      return InvalidArgument("the mean " + Text(mean) + " is not of pixel / 255: divide it by 255");
    }
  }
  for (const double s : options.std) {
    if (!(s > 0)) return InvalidArgument("std must be positive");
    if (!(s <= kMaxStd)) {
      return InvalidArgument("the std " + Text(s) + " is not of pixel / 255: divide it by 255");
    }
  }
  return Status::Ok();
}

Status Check(const OnnxOptions& options) {
  if (options.width_px < 0 || options.height_px < 0 || options.width_px > kMaxSizePx ||
      options.height_px > kMaxSizePx) {
    return InvalidArgument("input size must be 1 to 8192");
  }
  if (options.channel_order != "RGB" && options.channel_order != "BGR") {
    return InvalidArgument("channel order must be RGB or BGR");
  }
  return CheckScale(options);
}

// One photo of three channels goes in.
Status CheckInput(const OnnxFile& file) {
  if (file.inputs.size() != 1) {
    return InvalidArgument("takes " + std::to_string(file.inputs.size()) +
                           " inputs; one photo is all there is");
  }
  const std::vector<int64_t>& shape = file.inputs[0].shape;
  if (shape.size() == 4 && shape[1] == 3 && std::abs(shape[0]) == 1) return Status::Ok();
  return InvalidArgument("takes " + ShapeText(shape) + ", not one photo as 1 x 3 x height x width" +
                         kHowToExport);
}

// One side of the input: the model's, which that of the options must equal, or the options'.
Status ChooseSide(const std::string& side, int64_t of_model, int* of_options) {
  if (of_model < 0 && *of_options == 0) {
    return InvalidArgument("leaves its input " + side +
                           " open: give --global-width and "
                           "--global-height, those it was trained with");
  }
  if (of_model > 0 && *of_options > 0 && of_model != *of_options) {
    return InvalidArgument("takes a " + side + " of " + std::to_string(of_model) + ", not " +
                           std::to_string(*of_options) + ": leave that away");
  }
  if (of_model > kMaxSizePx) return InvalidArgument("takes more than 8192 pixels a side");
  if (of_model > 0) *of_options = static_cast<int>(of_model);
  return Status::Ok();
}

Status ChooseSize(const OnnxFile& file, OnnxOptions* options) {
  if (const Status status = CheckInput(file); !status.ok()) return status;
  const std::vector<int64_t>& shape = file.inputs[0].shape;
  const Status height = ChooseSide("height", shape[2], &options->height_px);
  return height.ok() ? ChooseSide("width", shape[3], &options->width_px) : height;
}

std::string OutputNames(const OnnxFile& file) {
  std::string names;
  for (const OnnxTensor& output : file.outputs) {
    names += (names.empty() ? "" : ", ") + output.name + " (" + ShapeText(output.shape) + ")";
  }
  return names;
}

// Whether all values stand along one axis.
Status CheckVector(const cv::Mat& output, const OnnxFile& file) {
  std::vector<int64_t> shape;
  int num_long = 0;
  for (int i = 0; i < output.dims; ++i) {
    shape.push_back(output.size[i]);
    num_long += output.size[i] > 1;
  }
  if (num_long <= 1 && output.total() > 1) return Status::Ok();
  return InvalidArgument("puts out " + ShapeText(shape) +
                         ", which is no vector of a photo: name a pooled output with "
                         "--global-output (there are: " +
                         OutputNames(file) + ")");
}

void ReadKey(const std::string& key, const nlohmann::json& value, OnnxOptions* options) {
  if (key == "width") {
    value.get_to(options->width_px);
  } else if (key == "height") {
    value.get_to(options->height_px);
  } else if (key == "mean") {
    value.get_to(options->mean);
  } else if (key == "std") {
    value.get_to(options->std);
  } else if (key == "channel_order") {
    value.get_to(options->channel_order);
  } else if (key == "output") {
    value.get_to(options->output);
  } else {
    throw std::invalid_argument("unknown key \"" + key + "\"");
  }
}

std::string FirstLine(const std::string& text) { return text.substr(0, text.find('\n')); }

// Model and preprocessing together: a change of either makes other vectors.
std::string IdOf(const Bytes& model, const OnnxOptions& o) {
  const nlohmann::json preprocessing = {o.width_px, o.height_px,     o.mean,
                                        o.std,      o.channel_order, o.output};
  Bytes all = model;
  const std::string text = preprocessing.dump();
  all.insert(all.end(), text.begin(), text.end());
  return "onnx-" + HashBytes(all.data(), all.size()).substr(0, 16);
}

cv::Mat ToInput(const cv::Mat& bgr, const OnnxOptions& options) {
  cv::Mat image;
  cv::resize(bgr, image, {options.width_px, options.height_px}, 0, 0, cv::INTER_AREA);
  if (options.channel_order == "RGB") cv::cvtColor(image, image, cv::COLOR_BGR2RGB);
  image.convertTo(image, CV_32FC3, 1.0 / 255);
  const auto& m = options.mean;
  const auto& s = options.std;
  cv::subtract(image, cv::Scalar(m[0], m[1], m[2]), image);
  cv::divide(image, cv::Scalar(s[0], s[1], s[2]), image);
  return cv::dnn::blobFromImage(image);
}

}  // namespace

struct OnnxModel::Net {
  cv::dnn::Net net;
};

Status ReadOnnxOptions(const std::string& json_text, OnnxOptions* options) {
  try {
    const auto json = nlohmann::json::parse(json_text);
    if (!json.is_object()) return InvalidArgument("not a JSON object");
    for (const auto& [key, value] : json.items()) ReadKey(key, value, options);
  } catch (const std::exception& e) {
    return InvalidArgument(e.what());
  }
  return Check(*options);
}

OnnxModel::OnnxModel(std::string id, const OnnxOptions& options, std::unique_ptr<Net> net)
    : id_(std::move(id)), options_(options), net_(std::move(net)) {}

OnnxModel::~OnnxModel() = default;

Result<std::shared_ptr<OnnxModel>> OnnxModel::Load(const std::string& path,
                                                   const OnnxOptions& asked) {
  OnnxOptions options = asked;
  Status status = Check(options);
  if (!status.ok()) return status;
  const auto bytes = ReadFile(path);
  if (!bytes) return bytes.status();
  const auto file = ReadOnnxFile(*bytes);
  status = file ? ChooseSize(*file, &options) : file.status();
  if (!status.ok()) return InvalidArgument(path + " " + status.error());
  try {
    auto net = std::make_unique<Net>();
    net->net = cv::dnn::readNetFromONNX(*bytes);
    net->net.setPreferableBackend(cv::dnn::DNN_BACKEND_OPENCV);
    net->net.setPreferableTarget(cv::dnn::DNN_TARGET_CPU);
    std::shared_ptr<OnnxModel> model(new OnnxModel(IdOf(*bytes, options), options, std::move(net)));
    const cv::Mat blank(options.height_px, options.width_px, CV_8UC3, cv::Scalar::all(128));
    const cv::Mat output = model->Forward(blank);
    status = CheckVector(output, *file);
    if (!status.ok()) return InvalidArgument(path + " " + status.error());
    model->dim_ = static_cast<int>(output.total());
    return model;
  } catch (const cv::Exception& e) {
    const std::string outputs =
        options.output.empty() ? ""
                               : ", output \"" + options.output + "\" of " + OutputNames(*file);
    return InvalidArgument(path + " cannot be run by OpenCV (opset " + std::to_string(file->opset) +
                           outputs + "): " + FirstLine(e.err) + kHowToExport);
  }
}

cv::Mat OnnxModel::Forward(const cv::Mat& upright_bgr) {
  net_->net.setInput(ToInput(upright_bgr, options_));
  return (options_.output.empty() ? net_->net.forward() : net_->net.forward(options_.output))
      .clone();
}

std::vector<float> OnnxModel::Describe(const DescribedPhoto& photo) {
  const cv::Mat output = Forward(UprightView(photo.decoded, photo.exif_orientation)).reshape(1, 1);
  const double norm = cv::norm(output);
  if (!(norm > 0) || !std::isfinite(norm)) return {};
  std::vector<float> values;
  output.convertTo(values, CV_32F, 1 / norm);
  return values;
}

}  // namespace skein
