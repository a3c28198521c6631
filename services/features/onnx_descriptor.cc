#include "features/onnx_descriptor.h"

#include <nlohmann/json.hpp>
#include <opencv2/dnn.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "core/file.h"
#include "core/hash.h"
#include "photo/image_decoding.h"

namespace skein {
namespace {

Status Check(const OnnxOptions& options) {
  if (options.width_px < 1 || options.height_px < 1 || options.width_px > 8192 ||
      options.height_px > 8192) {
    return InvalidArgument("input size must be 1 to 8192");
  }
  if (options.channel_order != "RGB" && options.channel_order != "BGR") {
    return InvalidArgument("channel order must be RGB or BGR");
  }
  for (const double s : options.std) {
    if (!(s > 0)) return InvalidArgument("std must be positive");
  }
  return Status::Ok();
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
                                                   const OnnxOptions& options) {
  const Status usable = Check(options);
  if (!usable.ok()) return usable;
  const auto bytes = ReadFile(path);
  if (!bytes) return bytes.status();
  try {
    auto net = std::make_unique<Net>();
    net->net = cv::dnn::readNetFromONNX(*bytes);
    net->net.setPreferableBackend(cv::dnn::DNN_BACKEND_OPENCV);
    net->net.setPreferableTarget(cv::dnn::DNN_TARGET_CPU);
    std::shared_ptr<OnnxModel> model(new OnnxModel(IdOf(*bytes, options), options, std::move(net)));
    const cv::Mat blank(options.height_px, options.width_px, CV_8UC3, cv::Scalar::all(128));
    model->dim_ = static_cast<int>(model->Forward(blank).total());
    if (model->dim_ < 1) return InvalidArgument(path + ": its output is empty");
    return model;
  } catch (const cv::Exception& e) {
    return InvalidArgument(path + " cannot be run by OpenCV: " + e.err);
  }
}

cv::Mat OnnxModel::Forward(const cv::Mat& upright_bgr) {
  net_->net.setInput(ToInput(upright_bgr, options_));
  cv::Mat output =
      options_.output.empty() ? net_->net.forward() : net_->net.forward(options_.output);
  return output.reshape(1, 1).clone();
}

std::vector<float> OnnxModel::Describe(const DescribedPhoto& photo) {
  const cv::Mat output = Forward(UprightView(photo.as_stored, photo.exif_orientation));
  const double norm = cv::norm(output);
  if (!(norm > 0) || !std::isfinite(norm)) return {};
  std::vector<float> values;
  output.convertTo(values, CV_32F, 1 / norm);
  return values;
}

}  // namespace skein
