#pragma once

#include <opencv2/core/utility.hpp>

namespace skein {

// Runs body(cv::Range) over 0..count-1, on the calling thread alone or on up to `threads` of
// OpenCV's (cv::setNumThreads).
template <typename Body>
void ParallelFor(int count, int threads, const Body& body) {
  if (threads <= 1 || count <= 1) return body(cv::Range(0, count));
  cv::parallel_for_(cv::Range(0, count), body, threads);
}

}  // namespace skein
