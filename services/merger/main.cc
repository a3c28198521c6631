#include "merger/merger_options.h"
#include "merger/merger_service.h"
#include "node/service_options.h"

int main(int argc, char** argv) {
  skein::NodeOptions node_options;
  node_options.service = "merger";
  skein::MergerOptions options;
  const char* description =
      "Starts submaps where photos have none, and joins submaps that overlap.";
  if (const auto code =
          skein::ParseServiceOptions(description, argc, argv, &node_options, &options)) {
    return *code;
  }
  return skein::RunService(node_options, [&](skein::Node& node) {
    skein::MergerService service(node, options);
    node.Run();
  });
}
