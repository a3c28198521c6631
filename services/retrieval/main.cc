#include "node/service_options.h"
#include "retrieval/retrieval_options.h"
#include "retrieval/retrieval_service.h"

int main(int argc, char** argv) {
  skein::NodeOptions node_options;
  node_options.service = "retrieval";
  return skein::RunServiceWithOptions<skein::RetrievalService, skein::RetrievalOptions>(
      node_options, "Finds the photos most like each new one, by their global descriptors.", argc,
      argv);
}
