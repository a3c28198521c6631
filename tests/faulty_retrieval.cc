// skein-retrieval with the faults of faults.h.
#include "faults.h"
#include "retrieval/retrieval_options.h"
#include "retrieval/retrieval_service.h"

int main(int argc, char** argv) {
  return skein::RunWithFaults<skein::RetrievalOptions>(
      "retrieval", argc, argv, [](skein::Node& node, const skein::RetrievalOptions& options) {
        skein::RetrievalService service(node, options);
        node.Run();
      });
}
