#include "features/onnx_descriptor.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "core/file.h"
#include "core/hash.h"
#include "photo/image_view.h"

namespace skein {
namespace {

constexpr int kMaxSizePx = 8192;

std::string Text(double value) {
  std::ostringstream text;
  text << value;
  return text.str();
}

constexpr double kMaxMean = 1;  // of pixel / 255
constexpr double kMaxStd = 10;
constexpr size_t kMaxLfsPointerBytes = 1024;  // the specification of Git LFS: "under 1024 bytes"

// "1 x 3 x 224 x ?".
std::string ShapeText(const std::vector<int64_t>& shape) {
  std::string text;
  for (const int64_t dim : shape) {
    text += (text.empty() ? "" : " x ") + (dim < 0 ? std::string("?") : std::to_string(dim));
  }
  return text;
}

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

bool IsLfsPointer(std::string_view text) {
  return text.size() < kMaxLfsPointerBytes && text.rfind("version ", 0) == 0 &&
         text.find("git-lfs") != std::string_view::npos;
}

Result<std::unique_ptr<OnnxNetwork>> ReadNetwork(const Bytes& model) {
  if (IsLfsPointer({reinterpret_cast<const char*>(model.data()), model.size()})) {
    return InvalidArgument(
        "is a Git LFS pointer, not the model itself: run git lfs pull where it is from");
  }
  return ReadOnnxNetwork(model);
}

// One photo of three channels goes in.
Status CheckInput(const OnnxNetwork& network) {
  if (network.inputs().size() != 1) {
    return InvalidArgument("takes " + std::to_string(network.inputs().size()) +
                           " inputs; one photo is all there is");
  }
  const std::vector<int64_t>& shape = network.inputs()[0].shape;
  if (shape.size() == 4 && shape[1] == 3 && std::abs(shape[0]) == 1) return Status::Ok();
  return InvalidArgument("takes " + ShapeText(shape) + ", not one photo as 1 x 3 x height x width" +
                         HowToExport());
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

Status ChooseSize(const OnnxNetwork& network, OnnxOptions* options) {
  const std::vector<int64_t>& shape = network.inputs()[0].shape;
  const Status height = ChooseSide("height", shape[2], &options->height_px);
  return height.ok() ? ChooseSide("width", shape[3], &options->width_px) : height;
}

std::string OutputNames(const OnnxNetwork& network) {
  std::string names;
  for (const OnnxValueInfo& output : network.outputs()) {
    names += (names.empty() ? "" : ", ") + output.name + " (" + ShapeText(output.shape) + ")";
  }
  return names;
}

Status CheckOutput(const OnnxNetwork& network, const std::string& name) {
  const auto& outputs = network.outputs();
  const bool is_there = std::any_of(outputs.begin(), outputs.end(), [&](const OnnxValueInfo& info) {
    return name.empty() || info.name == name;
  });
  if (is_there) return Status::Ok();
  return InvalidArgument("has no output \"" + name + "\"; there are: " + OutputNames(network));
}

// Checks the network against `options`, which get its size.
Status Fit(const OnnxNetwork& network, OnnxOptions* options) {
  if (Status status = CheckInput(network); !status.ok()) return status;
  if (Status status = ChooseSize(network, options); !status.ok()) return status;
  return CheckOutput(network, options->output);
}

// Whether all values stand along one axis.
bool IsVector(const OnnxTensor& tensor) {
  const auto is_long = [](int64_t size) { return size > 1; };
  return tensor.values.size() > 1 &&
         std::count_if(tensor.shape.begin(), tensor.shape.end(), is_long) == 1;
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

cv::Mat Normalise(const cv::Mat& bgr, const OnnxOptions& options) {
  cv::Mat image;
  cv::resize(bgr, image, {options.width_px, options.height_px}, 0, 0, cv::INTER_AREA);
  if (options.channel_order == "RGB") cv::cvtColor(image, image, cv::COLOR_BGR2RGB);
  image.convertTo(image, CV_32FC3, 1.0 / 255);
  const auto& m = options.mean;
  const auto& s = options.std;
  cv::subtract(image, cv::Scalar(m[0], m[1], m[2]), image);
  cv::divide(image, cv::Scalar(s[0], s[1], s[2]), image);
  return image;
}

// 1 x 3 x height x width.
OnnxTensor ToTensor(const cv::Mat& image) {
  OnnxTensor tensor{{1, 3, image.rows, image.cols}, std::vector<float>(3 * image.total())};
  std::array<cv::Mat, 3> planes;
  for (size_t i = 0; i < planes.size(); ++i) {
    planes[i] = cv::Mat(image.size(), CV_32F, tensor.values.data() + i * image.total());
  }
  cv::split(image, planes.data());
  return tensor;
}

}  // namespace

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

OnnxModel::OnnxModel(std::string id, const OnnxOptions& options,
                     std::unique_ptr<OnnxNetwork> network)
    : id_(std::move(id)), options_(options), network_(std::move(network)) {}

Result<std::shared_ptr<OnnxModel>> OnnxModel::Load(const std::string& path,
                                                   const OnnxOptions& asked) {
  OnnxOptions options = asked;
  Status status = Check(options);
  if (!status.ok()) return status;
  const auto bytes = ReadFile(path);
  if (!bytes) return bytes.status();
  auto network = ReadNetwork(*bytes);
  status = network ? Fit(**network, &options) : network.status();
  if (!status.ok()) return InvalidArgument(path + " " + status.error());
  std::shared_ptr<OnnxModel> model(
      new OnnxModel(IdOf(*bytes, options), options, *std::move(network)));
  status = model->MeasureDim();
  if (!status.ok()) return InvalidArgument(path + " " + status.error());
  return model;
}

Status OnnxModel::MeasureDim() {
  const auto output =
      Run(cv::Mat(options_.height_px, options_.width_px, CV_8UC3, cv::Scalar::all(128)));
  if (!output) return output.status();
  if (!IsVector(*output)) {
    return InvalidArgument("puts out " + ShapeText(output->shape) +
                           ", which is no vector of a photo: name a pooled output with "
                           "--global-output (there are: " +
                           OutputNames(*network_) + ")");
  }
  dim_ = static_cast<int>(output->values.size());
  return Status::Ok();
}

Result<OnnxTensor> OnnxModel::Run(const cv::Mat& upright_bgr) {
  return network_->Run(ToTensor(Normalise(upright_bgr, options_)), options_.output);
}

std::vector<float> OnnxModel::Describe(const DescribedPhoto& photo) {
  auto output = Run(UprightView(photo.decoded, photo.exif_orientation));
  if (!output) throw std::runtime_error("the global model " + output.error());
  std::vector<float>& values = output->values;
  if (static_cast<int>(values.size()) != dim_) {
    throw std::runtime_error("the global model puts out " + ShapeText(output->shape) + ", not " +
                             std::to_string(dim_) + " values as before");
  }
  const double norm = cv::norm(values);
  if (!(norm > 0) || !std::isfinite(norm)) return {};
  for (float& value : values) value = static_cast<float>(value / norm);
  return std::move(values);
}

}  // namespace skein
