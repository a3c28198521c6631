#include "guide/guide_options.h"
#include "guide/guide_service.h"
#include "node/service_options.h"

int main(int argc, char** argv) {
  skein::NodeOptions node_options;
  node_options.service = "guide";
  return skein::RunServiceWithOptions<skein::GuideService, skein::GuideOptions>(
      node_options, "Tells how complete each place is, and what each agent can photograph next.",
      argc, argv);
}
