// skein-guide with the faults of faults.h.
#include "faults.h"
#include "guide/guide_options.h"
#include "guide/guide_service.h"

int main(int argc, char** argv) {
  return skein::RunWithFaults<skein::GuideOptions>(
      "guide", argc, argv, [](skein::Node& node, const skein::GuideOptions& options) {
        skein::GuideService service(node, options);
        node.Run();
      });
}
