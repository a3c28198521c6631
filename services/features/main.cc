#include <cstdio>
#include <memory>
#include <opencv2/core.hpp>
#include <stdexcept>

#include "core/process.h"
#include "features/features_options.h"
#include "features/features_service.h"
#include "node/service_options.h"

int main(int argc, char** argv) {
  skein::NodeOptions node_options;
  node_options.service = "features";
  skein::FeaturesOptions options;
  const char* description = "Local features and a global descriptor of each photo.";
  if (const auto code =
          skein::ParseServiceOptions(description, argc, argv, &node_options, &options)) {
    return *code;
  }
  std::shared_ptr<skein::GlobalDescriptorModel> model;
  try {
    skein::CapThreads(node_options.threads);
    cv::setNumThreads(node_options.threads);
    model = skein::LoadModel(options.model);
  } catch (const std::invalid_argument& error) {
    std::fprintf(stderr, "skein-features: %s\n", error.what());
    return 2;
  }
  return skein::RunService(node_options, [&](skein::Node& node) {
    auto decoder = skein::PhotoDecoder::Start(options.decoder);
    if (!decoder.ok()) throw std::runtime_error(decoder.error());
    skein::FeaturesService service(node, options.sift, node_options.threads, model,
                                   *std::move(decoder));
    node.Run();
  });
}
