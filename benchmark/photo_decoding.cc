// What it costs that photos are decoded in a child process: time of a check (ingest) and of decoding
// to pixels (features), in this process and in the child, in turn.
//
//   photo_decoding [repetitions]
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "codecs/check_photo.h"
#include "codecs/image_decoding.h"
#include "photo/photo_decoder.h"

namespace {

using Clock = std::chrono::steady_clock;

struct Comparison {
  double here_ms = 0;
  double child_ms = 0;
};

double Ms(const std::function<bool()>& run) {
  const auto start = Clock::now();
  if (!run()) throw std::runtime_error("a photo was not decoded");
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

// Of times that others on the machine lengthen: the lower quartile.
double LowerQuartile(std::vector<double>* times) {
  const auto quarter = times->begin() + static_cast<ptrdiff_t>(times->size() / 4);
  std::nth_element(times->begin(), quarter, times->end());
  return *quarter;
}

// Wall time.
Comparison Compare(int repetitions, const std::function<bool()>& here,
                   const std::function<bool()>& child) {
  std::vector<double> here_ms, child_ms;
  for (int i = 0; i <= repetitions; ++i) {
    const std::array<double, 2> ms = {Ms(here), Ms(child)};
    if (i == 0) continue;  // the first fills caches
    here_ms.push_back(ms[0]);
    child_ms.push_back(ms[1]);
  }
  return {LowerQuartile(&here_ms), LowerQuartile(&child_ms)};
}

// Structure at every scale, as in a photo: about 3 bits a pixel as a JPEG.
skein::Bytes MakeJpeg(int width, int height) {
  cv::Mat image(height, width, CV_8UC3, cv::Scalar::all(128)), layer;
  cv::RNG rng(1);
  for (int side = 8; side < width; side *= 2) {
    cv::Mat noise(std::max(1, side * height / width), side, CV_8UC3);
    rng.fill(noise, cv::RNG::NORMAL, 128, 30);
    cv::resize(noise, layer, image.size(), 0, 0, cv::INTER_CUBIC);
    cv::addWeighted(image, 1, layer, 0.5, -64, image);
  }
  skein::Bytes jpeg;
  cv::imencode(".jpg", image, jpeg, {cv::IMWRITE_JPEG_QUALITY, 92});
  return jpeg;
}

void Print(const char* what, const Comparison& ms) {
  std::printf("  %-7s %8.2f ms here %8.2f ms in the child   %+6.2f %%\n", what, ms.here_ms,
              ms.child_ms, 100 * (ms.child_ms / ms.here_ms - 1));
}

std::string ProcessorName() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);) {
    if (line.rfind("model name", 0) == 0) return line.substr(line.find(':') + 2);
  }
  return "?";
}

}  // namespace

int main(int argc, char** argv) {
  const int repetitions = argc > 1 ? std::atoi(argv[1]) : 41;
  cv::setNumThreads(1);
  double start_ms = 0;
  std::unique_ptr<skein::PhotoDecoder> decoder;
  start_ms = Ms([&] {
    auto started = skein::PhotoDecoder::Start();
    if (started.ok()) decoder = *std::move(started);
    return decoder != nullptr;
  });
  std::printf("%s, commit %s, lower quartile of %d; a child starts in %.0f ms\n", ProcessorName().c_str(),
              SKEIN_COMMIT, repetitions, start_ms);
  for (const cv::Size size : {cv::Size(4000, 3000), cv::Size(1600, 1200)}) {
    const skein::Bytes jpeg = MakeJpeg(size.width, size.height);
    std::printf("JPEG of %d x %d, %.1f MB\n", size.width, size.height, 1e-6 * jpeg.size());
    const skein::PhotoLimits limits;
    Print("check", Compare(
                       repetitions, [&] { return skein::CheckPhoto(jpeg, limits).ok(); },
                       [&] { return decoder->Check(jpeg, limits).ok(); }));
    Print("decode", Compare(
                        repetitions, [&] { return skein::DecodePhoto(jpeg).ok(); },
                        [&] { return decoder->Decode(jpeg).ok(); }));
  }
  return 0;
}
