#include <opencv2/core.hpp>

#include "dense/dense_options.h"
#include "dense/dense_service.h"
#include "node/service_options.h"

int main(int argc, char** argv) {
  skein::NodeOptions node_options;
  node_options.service = "dense";
  cv::setNumThreads(1);
  return skein::RunServiceWithOptions<skein::DenseService, skein::DenseOptions>(
      node_options, "Depth maps and dense points of each place while it is photographed.", argc,
      argv);
}
