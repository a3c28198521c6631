#include "clients/progress_bar.h"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <utility>

namespace skein {
namespace {

constexpr int kWidth = 40;

double NowS() {
  const auto now = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration<double>(now).count();
}

}  // namespace

ProgressBar::ProgressBar(std::string what, int64_t total)
    : what_(std::move(what)),
      total_(std::max<int64_t>(1, total)),
      terminal_(isatty(STDERR_FILENO) != 0),
      start_s_(NowS()) {}

ProgressBar::~ProgressBar() {
  if (terminal_ && drawn_tenth_ >= 0) std::fprintf(stderr, "\n");
}

void ProgressBar::Add(int64_t done) {
  const std::lock_guard<std::mutex> lock(mutex_);
  done_ += done;
  Draw();
}

void ProgressBar::Set(int64_t done) {
  const std::lock_guard<std::mutex> lock(mutex_);
  done_ = done;
  Draw();
}

void ProgressBar::Draw() {
  const int64_t done = std::min(done_, total_);
  const int64_t tenth = 10 * done / total_;
  const double elapsed_s = NowS() - start_s_;
  if (terminal_) {
    const int filled = static_cast<int>(kWidth * done / total_);
    std::fprintf(stderr, "\r%-14s [%s%s] %lld/%lld  %.0f s ", what_.c_str(),
                 std::string(filled, '#').c_str(), std::string(kWidth - filled, '.').c_str(),
                 static_cast<long long>(done_), static_cast<long long>(total_), elapsed_s);
    drawn_tenth_ = tenth;
  } else if (tenth > drawn_tenth_) {
    std::fprintf(stderr, "%s %lld/%lld  %.0f s\n", what_.c_str(), static_cast<long long>(done_),
                 static_cast<long long>(total_), elapsed_s);
    drawn_tenth_ = tenth;
  }
}

}  // namespace skein
