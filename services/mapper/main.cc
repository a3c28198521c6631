#include "mapper/mapper_options.h"
#include "mapper/mapper_service.h"
#include "node/service_options.h"

int main(int argc, char** argv) {
  skein::NodeOptions node_options;
  node_options.service = "mapper";
  skein::MapperOptions options;
  const char* description = "Registers photos in one submap: poses, points, bundle adjustment.";
  if (const auto code =
          skein::ParseServiceOptions(description, argc, argv, &node_options, &options)) {
    return *code;
  }
  options.run.submap.num_threads = node_options.threads;
  return skein::RunService(node_options, [&](skein::Node& node) {
    skein::MapperService service(node, options.run, options.retire_after_s);
    node.Run();
  });
}
