#include "depth/bare_areas.h"

#include <opencv2/imgproc.hpp>
#include <vector>

namespace skein {
namespace {

cv::Mat1b FindBarePixels(const cv::Mat1b& grey) {
  cv::Mat1b least, most;
  const cv::Mat around = cv::Mat::ones(3, 3, CV_8U);
  cv::erode(grey, least, around);
  cv::dilate(grey, most, around);
  return most - least <= kBareRange;
}

}  // namespace

void RemoveDepthsOfBareAreas(const cv::Mat1b& grey, DepthMap* map) {
  cv::Mat1i areas, stats;  // areas: a number each pixel; 0: not bare
  cv::Mat centroids;
  const int num_areas =
      cv::connectedComponentsWithStats(FindBarePixels(grey), areas, stats, centroids, 4, CV_32S);
  std::vector<int> num_depths(num_areas, 0);
  for (int y = 0; y < areas.rows; ++y) {
    for (int x = 0; x < areas.cols; ++x) num_depths[areas(y, x)] += map->depth(y, x) > 0;
  }
  cv::Mat1b is_borrowed(areas.size(), uint8_t{0});
  for (int y = 0; y < areas.rows; ++y) {
    for (int x = 0; x < areas.cols; ++x) {
      const int area = areas(y, x);
      const bool has_few = 2 * num_depths[area] < stats(area, cv::CC_STAT_AREA);
      if (area > 0 && has_few) is_borrowed(y, x) = 255;
    }
  }
  map->MakeHoles(is_borrowed);
}

}  // namespace skein
