#include "features/features_options.h"

#include <CLI/CLI.hpp>

#include "config/kernel_choice.h"
#include "core/option_check.h"

namespace skein {

Status FeaturesOptions::Check() const {
  return FirstError({sift.method == "skein" || sift.method == "opencv"
                         ? Status::Ok()
                         : InvalidArgument("sift is " + sift.method + ": give skein or opencv"),
                     IsInstructionSetSupported(sift.kernel)
                         ? Status::Ok()
                         : InvalidArgument("kernel " + InstructionSetName(sift.kernel) +
                                           " needs another processor: give fastest"),
                     InRange("max_size", sift.max_image_px, 64, 16384),
                     InRange("max_features", sift.max_features, 1, 65536), model.Check()});
}

void AddOptions(CLI::App& app, FeaturesOptions* options) {
  SiftOptions& sift = options->sift;
  ModelChoice& model = options->model;
  app.add_option("--sift", sift.method, "Whose SIFT: skein or opencv, the latter for comparison");
  AddKernelChoice(app, kInstructionSets, InstructionSetName, FastestInstructionSet(), &sift.kernel,
                  "SIFT kernel: the fastest that the processor has, or portable, avx2 or avx512");
  app.add_option("--max-size", sift.max_image_px, "Longest side of the searched photo, pixels");
  app.add_option("--max-features", sift.max_features, "Most keypoints a photo");
  app.add_option("--codebook", model.codebook_path, "VLAD codebook; default: the shipped one");
  app.add_option("--global-model", model.onnx_path,
                 "ONNX model to describe photos with, in place of VLAD");
  app.add_option("--global-width", model.width_px,
                 "Input width of the ONNX model, pixels; 0: what the model says");
  app.add_option("--global-height", model.height_px, "Likewise, its height");
  app.add_option("--global-mean", model.mean,
                 "Three means, subtracted from pixel / 255; default: torchvision's");
  app.add_option("--global-std", model.std,
                 "Three standard deviations, divided by; default: torchvision's");
  app.add_option("--global-channels", model.channel_order, "RGB (default) or BGR");
  app.add_option("--global-output", model.output,
                 "Name of the ONNX model's output; default: its last");
  app.add_option("--decoder", options->decoder.program,
                 "Program that decodes photos; default: skein-decoder beside this program");
}

}  // namespace skein
