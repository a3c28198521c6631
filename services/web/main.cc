#include <cstdio>

#include "node/service_options.h"
#include "web/visitors.h"
#include "web/web_options.h"
#include "web/web_service.h"

int main(int argc, char** argv) {
  skein::NodeOptions node_options;
  node_options.service = "web";
  node_options.signer.role = skein::Role::kViewer;
  skein::WebOptions options;
  const char* description = "Shows the session in a browser while it grows.";
  if (const auto code =
          skein::ParseServiceOptions(description, argc, argv, &node_options, &options)) {
    return *code;
  }
  const skein::Status admits = skein::CheckVisitors(node_options);
  if (options.is_public() && !admits.ok()) {
    std::fprintf(stderr, "skein-web: %s\n", admits.error().c_str());
    return 2;
  }
  if (admits.ok()) node_options.signer.role = skein::Role::kWeb;
  return skein::RunService(node_options, [&](skein::Node& node) {
    skein::WebService service(node, options);
    node.Run();
  });
}
