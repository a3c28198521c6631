#include "matching/matching_options.h"
#include "matching/matching_service.h"
#include "node/service_options.h"

int main(int argc, char** argv) {
  skein::NodeOptions node_options;
  node_options.service = "matching";
  node_options.cache_bytes = size_t{32} << 20;  // decoded features have a cache of their own
  return skein::RunServiceWithOptions<skein::MatchingService, skein::MatchingServiceOptions>(
      node_options,
      "Matches each photo with its candidates and verifies the geometry of each pair.", argc, argv);
}
