// skein-mapper with the faults of faults.h.
#include "faults.h"
#include "mapper/mapper_options.h"
#include "mapper/mapper_service.h"
#include "node/service_options.h"

int main(int argc, char** argv) {
  skein::NodeOptions node_options;
  node_options.service = "mapper";
  skein::MapperOptions options;
  if (const auto code = skein::ParseServiceOptions("A mapper with faults.", argc, argv,
                                                   &node_options, &options)) {
    return *code;
  }
  return skein::RunService(node_options, [&](skein::Node& node) {
    skein::InjectFaults(&node.steps());
    skein::MapperService service(node, options.run, options.retire_after_s);
    node.Run();
  });
}
