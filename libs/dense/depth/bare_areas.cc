#include "depth/bare_areas.h"

#include <opencv2/imgproc.hpp>
#include <vector>

namespace skein {
namespace {

// Numbers of the connected bare areas, from 1; 0: not bare.
cv::Mat1i LabelBareAreas(const cv::Mat1b& grey, int* num_labels) {
  cv::Mat1b least, most;
  const cv::Mat around = cv::Mat::ones(3, 3, CV_8U);
  cv::erode(grey, least, around);
  cv::dilate(grey, most, around);
  cv::Mat1i labels;
  *num_labels = cv::connectedComponents(cv::Mat1b(most - least <= kBareRange), labels, 4, CV_32S);
  return labels;
}

}  // namespace

void RemoveDepthsOfBareAreas(const cv::Mat1b& grey, DepthMap* map) {
  int num_labels = 0;
  const cv::Mat1i labels = LabelBareAreas(grey, &num_labels);
  const cv::Mat1b has_depth = map->depth > 0;
  std::vector<int> pixels(num_labels, 0), depths(num_labels, 0);
  for (int y = 0; y < labels.rows; ++y) {
    for (int x = 0; x < labels.cols; ++x) {
      ++pixels[labels(y, x)];
      depths[labels(y, x)] += has_depth(y, x) != 0;
    }
  }
  for (int y = 0; y < labels.rows; ++y) {
    for (int x = 0; x < labels.cols; ++x) {
      const int label = labels(y, x);
      if (label == 0 || 2 * depths[label] >= pixels[label]) continue;
      map->depth(y, x) = 0;
      map->error(y, x) = 0;
    }
  }
}

}  // namespace skein
