// skein-guide with the faults of faults.h.
#include "faults.h"
#include "guide/guide_options.h"
#include "guide/guide_service.h"
#include "node/service_options.h"

int main(int argc, char** argv) {
  skein::NodeOptions node_options;
  node_options.service = "guide";
  skein::GuideOptions options;
  if (const auto code =
          skein::ParseServiceOptions("A guide with faults.", argc, argv, &node_options, &options)) {
    return *code;
  }
  return skein::RunService(node_options, [&](skein::Node& node) {
    skein::InjectFaults(&node.steps());
    skein::GuideService service(node, options);
    node.Run();
  });
}
