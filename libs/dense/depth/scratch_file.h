// Pixels that are kept in a file rather than in memory.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <opencv2/core.hpp>

#include "core/result.h"

namespace skein {

// A file without a name, mapped into memory. The kernel writes its pages out when memory is short,
// and reads them again when they are asked for. The file ends with the object, or with the process.
class ScratchFile {
 public:
  // A file of `bytes` in `folder`. Its blocks are allocated here, so a disk that fills up later
  // does not stop the process (SIGBUS). Error: the folder is none, or its disk has less room.
  static Result<std::unique_ptr<ScratchFile>> Make(const std::filesystem::path& folder,
                                                   int64_t bytes);
  // Bytes of the file that a copy of so many bytes takes.
  static int64_t BytesFor(int64_t bytes);

  ~ScratchFile();
  ScratchFile(const ScratchFile&) = delete;
  ScratchFile& operator=(const ScratchFile&) = delete;

  // A copy in the file, valid as long as the file. For any thread. Throws std::length_error if the
  // file has no room left.
  template <typename T>
  cv::Mat_<T> Keep(const cv::Mat_<T>& pixels) {
    return cv::Mat_<T>(Copy(pixels));
  }

 private:
  ScratchFile(uint8_t* data, int64_t bytes) : data_(data), bytes_(bytes) {}
  cv::Mat Copy(const cv::Mat& pixels);

  uint8_t* const data_;
  const int64_t bytes_;
  std::atomic<int64_t> used_{0};
};

}  // namespace skein
