#include "matching/matching_options.h"
#include "matching/matching_service.h"
#include "node/service_options.h"

int main(int argc, char** argv) {
  skein::NodeOptions node_options;
  node_options.service = "matching";
  node_options.cache_bytes = size_t{32} << 20;  // decoded features have a cache of their own
  skein::MatchingServiceOptions options;
  const char* description =
      "Matches each photo with its candidates and verifies the geometry of each pair.";
  if (const auto code =
          skein::ParseServiceOptions(description, argc, argv, &node_options, &options)) {
    return *code;
  }
  return skein::RunService(node_options, [&](skein::Node& node) {
    skein::MatchingService service(node, options);
    node.Run();
  });
}
