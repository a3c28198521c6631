// skein-retrieval with the faults of faults.h.
#include "faults.h"
#include "node/service_options.h"
#include "retrieval/retrieval_options.h"
#include "retrieval/retrieval_service.h"

int main(int argc, char** argv) {
  skein::NodeOptions node_options;
  node_options.service = "retrieval";
  skein::RetrievalOptions options;
  if (const auto code = skein::ParseServiceOptions("Retrieval with faults.", argc, argv,
                                                   &node_options, &options)) {
    return *code;
  }
  return skein::RunService(node_options, [&](skein::Node& node) {
    skein::InjectFaults(&node.steps());
    skein::RetrievalService service(node, options);
    node.Run();
  });
}
