// What it costs that photos are decoded in a child process: time of a check (ingest) and of
// decoding to pixels (features), in this process and in the child, in turn. Processor time is that
// of both.
//
//   photo_decoding [repetitions]
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
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

double CpuMs(pid_t process) {
  clockid_t clock = 0;
  timespec time{};
  clock_getcpuclockid(process, &clock);
  clock_gettime(clock, &time);
  return 1e3 * static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_nsec);
}

// The one child of this process.
pid_t Child() {
  for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
    std::ifstream stat(entry.path() / "stat");
    std::string pid, name, state;
    pid_t parent = 0;
    if (stat >> pid >> name >> state >> parent && parent == getpid()) return std::stoi(pid);
  }
  throw std::runtime_error("there is no child");
}

// Of this process and its child.
struct Times {
  double wall_ms = 0;
  double cpu_ms = 0;
};

Times TimesOf(pid_t child, const std::function<bool()>& run) {
  const auto start = Clock::now();
  const double cpu_ms = CpuMs(getpid()) + CpuMs(child);
  if (!run()) throw std::runtime_error("a photo was not decoded");
  return {std::chrono::duration<double, std::milli>(Clock::now() - start).count(),
          CpuMs(getpid()) + CpuMs(child) - cpu_ms};
}

// Of times that others on the machine lengthen: the lower quartile.
double LowerQuartile(std::vector<double>* times) {
  const auto quarter = times->begin() + static_cast<ptrdiff_t>(times->size() / 4);
  std::nth_element(times->begin(), quarter, times->end());
  return *quarter;
}

class Series {
 public:
  void Add(const Times& times) {
    wall_ms_.push_back(times.wall_ms);
    cpu_ms_.push_back(times.cpu_ms);
  }
  Times Get() { return {LowerQuartile(&wall_ms_), LowerQuartile(&cpu_ms_)}; }

 private:
  std::vector<double> wall_ms_, cpu_ms_;
};

void Compare(const char* what, pid_t process, int repetitions, const std::function<bool()>& here,
             const std::function<bool()>& child) {
  Series times_here, times_child;
  for (int i = 0; i <= repetitions; ++i) {
    const Times of_here = TimesOf(process, here), of_child = TimesOf(process, child);
    if (i == 0) continue;  // the first fills caches
    times_here.Add(of_here);
    times_child.Add(of_child);
  }
  const Times a = times_here.Get(), b = times_child.Get();
  std::printf("  %-19s processor %7.2f ms here, %7.2f in the child (%+.2f %%); wall %7.2f, %7.2f\n",
              what, a.cpu_ms, b.cpu_ms, 100 * (b.cpu_ms / a.cpu_ms - 1), a.wall_ms, b.wall_ms);
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
  const auto start = Clock::now();
  const auto decoder = skein::PhotoDecoder::Start();
  const std::chrono::duration<double, std::milli> start_time = Clock::now() - start;
  if (!decoder.ok()) {
    std::fprintf(stderr, "photo_decoding: %s\n", decoder.error().c_str());
    return 1;
  }
  std::printf("%s, commit %s, lower quartile of %d; a child starts in %.0f ms\n",
              ProcessorName().c_str(), SKEIN_COMMIT, repetitions, start_time.count());
  for (const cv::Size size : {cv::Size(4000, 3000), cv::Size(1600, 1200)}) {
    const skein::Bytes jpeg = MakeJpeg(size.width, size.height);
    std::printf("JPEG of %d x %d, %.1f MB\n", size.width, size.height, 1e-6 * jpeg.size());
    const skein::PhotoLimits limits;
    Compare(
        "check", Child(), repetitions, [&] { return skein::CheckPhoto(jpeg, limits).ok(); },
        [&] { return (*decoder)->Check(jpeg, limits).ok(); });
    Compare(
        "decode", Child(), repetitions, [&] { return skein::DecodePhoto(jpeg).ok(); },
        [&] { return (*decoder)->Decode(jpeg).ok(); });
    Compare(
        "decode for 1,600 px", Child(), repetitions, [&] { return skein::DecodePhoto(jpeg).ok(); },
        [&] { return (*decoder)->Decode(jpeg, 1600).ok(); });
  }
  return 0;
}
