#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <opencv2/core.hpp>

#include "core/process.h"
#include "features/features_service.h"
#include "features/model_choice.h"
#include "node/node.h"

namespace {

void AddOptions(CLI::App& app, skein::SiftOptions* sift, skein::ModelChoice* choice) {
  app.add_option("--max-size", sift->max_image_px, "Longest side of the searched photo, pixels")
      ->check(CLI::Range(64, 16384))
      ->capture_default_str();
  app.add_option("--max-features", sift->selection.max_features, "Most keypoints a photo")
      ->check(CLI::Range(1, 65536))
      ->capture_default_str();
  app.add_option("--codebook", choice->codebook_path, "VLAD codebook; default: the shipped one");
  app.add_option("--global-model", choice->onnx_path,
                 "ONNX model to describe photos with, in place of VLAD");
  app.add_option("--global-width", choice->width_px, "Input width of the ONNX model, pixels");
  app.add_option("--global-height", choice->height_px, "Input height of the ONNX model, pixels");
  app.add_option("--global-mean", choice->mean, "Three means, subtracted from pixel / 255");
  app.add_option("--global-std", choice->std, "Three standard deviations, divided by");
  app.add_option("--global-channels", choice->channel_order, "RGB or BGR");
  app.add_option("--global-output", choice->output, "Name of the ONNX model's output");
}

}  // namespace

int main(int argc, char** argv) {
  skein::NodeOptions options;
  options.service = "features";
  skein::SiftOptions sift;
  skein::ModelChoice choice;
  CLI::App app("Local features and a global descriptor of each photo.");
  skein::AddCommonOptions(app, &options);
  AddOptions(app, &sift, &choice);
  if (const auto code = skein::ParseCommandLine(app, argc, argv)) return *code;

  std::shared_ptr<skein::GlobalDescriptorModel> model;
  try {
    skein::CapThreads(options.threads);
    cv::setNumThreads(options.threads);
    model = skein::LoadModel(choice);
  } catch (const std::invalid_argument& error) {
    std::fprintf(stderr, "skein-features: %s\n", error.what());
    return 2;
  }
  return skein::RunService(options, [&](skein::Node& node) {
    skein::FeaturesService service(node, sift, model);
    node.Run();
  });
}
