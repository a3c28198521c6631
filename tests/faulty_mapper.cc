// skein-mapper with the faults of faults.h.
#include "faults.h"
#include "mapper/mapper_options.h"
#include "mapper/mapper_service.h"

int main(int argc, char** argv) {
  return skein::RunWithFaults<skein::MapperOptions>(
      "mapper", argc, argv, [](skein::Node& node, const skein::MapperOptions& options) {
        skein::MapperService service(node, options.run, options.retire_after_s);
        node.Run();
      });
}
