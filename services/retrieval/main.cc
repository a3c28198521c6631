#include "node/service_options.h"
#include "retrieval/retrieval_options.h"
#include "retrieval/retrieval_service.h"

int main(int argc, char** argv) {
  skein::NodeOptions node_options;
  node_options.service = "retrieval";
  skein::RetrievalOptions options;
  const char* description = "Finds the photos most like each new one, by their global descriptors.";
  if (const auto code =
          skein::ParseServiceOptions(description, argc, argv, &node_options, &options)) {
    return *code;
  }
  return skein::RunService(node_options, [&](skein::Node& node) {
    skein::RetrievalService service(node, options);
    node.Run();
  });
}
