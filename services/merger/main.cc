#include "merger/merger_options.h"
#include "merger/merger_service.h"
#include "node/service_options.h"

int main(int argc, char** argv) {
  skein::NodeOptions node_options;
  node_options.service = "merger";
  return skein::RunServiceWithOptions<skein::MergerService, skein::MergerOptions>(
      node_options, "Starts submaps where photos have none, and joins submaps that overlap.", argc,
      argv);
}
