// Time of matching one pair of photos with 8,192 descriptors each on one core: each version of the
// kernel, and OpenCV's brute-force matcher in the same run.
//
//   matching_kernel [repetitions]

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <functional>
#include <opencv2/features2d.hpp>
#include <random>
#include <string>

#include "matching/kernel.h"

namespace {

constexpr int kCount = 8192;

double ThreadCpuMs() {
  timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return 1e3 * t.tv_sec + 1e-6 * t.tv_nsec;
}

// Median over the repetitions, CPU time of this thread.
double MedianMs(int repetitions, const std::function<void()>& run) {
  run();
  std::vector<double> times;
  for (int i = 0; i < repetitions; ++i) {
    const double start = ThreadCpuMs();
    run();
    times.push_back(ThreadCpuMs() - start);
  }
  std::nth_element(times.begin(), times.begin() + times.size() / 2, times.end());
  return times[times.size() / 2];
}

std::vector<uint8_t> RandomRootSift(std::mt19937* rng) {
  std::gamma_distribution<double> gamma(0.4, 1.0);
  std::vector<uint8_t> out;
  for (int i = 0; i < kCount; ++i) {
    double values[skein::kDescriptorDim], sum = 0;
    for (double& v : values) sum += v = gamma(*rng);
    for (double v : values) out.push_back(std::min(255.0, 512 * std::sqrt(v / sum)));
  }
  return out;
}

void OpenCvBothWays(const cv::Mat& a, const cv::Mat& b) {
  const cv::BFMatcher matcher(cv::NORM_L2);
  std::vector<std::vector<cv::DMatch>> forward, backward;
  matcher.knnMatch(a, b, forward, 2);
  matcher.knnMatch(b, a, backward, 2);
}

std::string ProcessorName() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);) {
    if (line.rfind("model name", 0) == 0) return line.substr(line.find(':') + 2);
  }
  return "unknown";
}

}  // namespace

int main(int argc, char** argv) {
  const int repetitions = argc > 1 ? std::max(1, std::atoi(argv[1])) : 9;
  cv::setNumThreads(1);
  std::mt19937 rng(7);
  const auto a = RandomRootSift(&rng), b = RandomRootSift(&rng);
  const auto compact_a = skein::CompactDescriptors(a), compact_b = skein::CompactDescriptors(b);
  std::printf(
      "machine: %s\ncommit: %s\n%d x %d descriptors, both directions, one core, median of %d\n",
      ProcessorName().c_str(), SKEIN_COMMIT, kCount, kCount, repetitions);

  double opencv_ms = 1e30;
  for (const int type : {CV_8U, CV_32F}) {
    cv::Mat ma, mb;
    cv::Mat(kCount, 128, CV_8U, const_cast<uint8_t*>(a.data())).convertTo(ma, type);
    cv::Mat(kCount, 128, CV_8U, const_cast<uint8_t*>(b.data())).convertTo(mb, type);
    const double ms = MedianMs(std::max(1, repetitions / 4), [&] { OpenCvBothWays(ma, mb); });
    std::printf("%-26s %8.1f ms\n",
                type == CV_8U ? "OpenCV BFMatcher uint8" : "OpenCV BFMatcher float", ms);
    opencv_ms = std::min(opencv_ms, ms);
  }
  for (const skein::KernelVersion version : skein::kKernelVersions) {
    if (!skein::IsKernelSupported(version)) continue;
    skein::MatchOptions options;
    options.kernel = version;
    skein::DescriptorMatcher matcher(options);
    const double ms = MedianMs(repetitions, [&] {
      matcher.Match({compact_a.data(), kCount}, {compact_b.data(), kCount});
    });
    std::printf("skein %-20s %8.1f ms   %6.1f x faster than OpenCV\n",
                skein::KernelName(version).c_str(), ms, opencv_ms / ms);
  }
  return 0;
}
