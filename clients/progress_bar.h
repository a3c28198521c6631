// A progress bar on stderr; on something that is no terminal, a line each tenth.
#pragma once

#include <cstdint>
#include <mutex>
#include <string>

namespace skein {

class ProgressBar {
 public:
  ProgressBar(std::string what, int64_t total);
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  void Add(int64_t done = 1);  // any thread
  void Set(int64_t done);      // any thread

 private:
  void Draw();

  const std::string what_;
  const int64_t total_;
  const bool terminal_;
  const double start_s_;
  std::mutex mutex_;
  int64_t done_ = 0;
  int64_t drawn_tenth_ = -1;
};

}  // namespace skein
