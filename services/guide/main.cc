#include "guide/guide_options.h"
#include "guide/guide_service.h"
#include "node/service_options.h"

int main(int argc, char** argv) {
  skein::NodeOptions node_options;
  node_options.service = "guide";
  skein::GuideOptions options;
  const char* description =
      "Tells how complete each place is, and what each agent can photograph next.";
  if (const auto code =
          skein::ParseServiceOptions(description, argc, argv, &node_options, &options)) {
    return *code;
  }
  return skein::RunService(node_options, [&](skein::Node& node) {
    skein::GuideService service(node, options);
    node.Run();
  });
}
