#include <opencv2/core.hpp>

#include "dense/dense_options.h"
#include "dense/dense_service.h"
#include "node/service_options.h"

int main(int argc, char** argv) {
  skein::NodeOptions node_options;
  node_options.service = "dense";
  skein::DenseOptions options;
  const char* description = "Depth maps and dense points of each place while it is photographed.";
  if (const auto code =
          skein::ParseServiceOptions(description, argc, argv, &node_options, &options)) {
    return *code;
  }
  return skein::RunService(node_options, [&](skein::Node& node) {
    cv::setNumThreads(1);
    skein::DenseService service(node, options);
    node.Run();
  });
}
