#include "features/model_choice.h"

#include <algorithm>
#include <filesystem>
#include <stdexcept>

#include "core/file.h"
#include "core/option_check.h"
#include "features/vlad.h"

namespace skein {
namespace fs = std::filesystem;
namespace {

void TakeTriple(const std::vector<double>& values, std::array<double, 3>* triple) {
  if (!values.empty()) std::copy(values.begin(), values.end(), triple->begin());
}

Status CheckTriple(const std::string& option, const std::vector<double>& values) {
  if (values.empty() || values.size() == 3) return Status::Ok();
  return InvalidArgument(option + " needs three values");
}

OnnxOptions ReadOptions(const ModelChoice& choice) {
  OnnxOptions options;
  const fs::path json_path = fs::path(choice.onnx_path).replace_extension(".json");
  if (fs::exists(json_path)) {
    const auto text = ReadFile(json_path);
    const Status status =
        text ? ReadOnnxOptions({text->begin(), text->end()}, &options) : text.status();
    if (!status.ok()) throw std::invalid_argument(json_path.string() + ": " + status.error());
  }
  if (choice.width_px > 0) options.width_px = choice.width_px;
  if (choice.height_px > 0) options.height_px = choice.height_px;
  if (!choice.channel_order.empty()) options.channel_order = choice.channel_order;
  if (!choice.output.empty()) options.output = choice.output;
  TakeTriple(choice.mean, &options.mean);
  TakeTriple(choice.std, &options.std);
  return options;
}

}  // namespace

Status ModelChoice::Check() const {
  if (!codebook_path.empty() && !onnx_path.empty()) {
    return InvalidArgument("codebook and global_model exclude each other: give one");
  }
  return FirstError({InRange("global_width", width_px, 0, 8192),
                     InRange("global_height", height_px, 0, 8192), CheckTriple("global_mean", mean),
                     CheckTriple("global_std", std)});
}

std::shared_ptr<GlobalDescriptorModel> LoadModel(const ModelChoice& choice) {
  if (const Status checked = choice.Check(); !checked.ok()) {
    throw std::invalid_argument(checked.error());
  }
  if (choice.onnx_path.empty()) {
    return std::make_shared<VladModel>(CodebookOf(choice.codebook_path));
  }
  auto model = OnnxModel::Load(choice.onnx_path, ReadOptions(choice));
  if (!model) throw std::invalid_argument("--global-model: " + model.error());
  return *model;
}

}  // namespace skein
