#pragma once

#include <cstdint>
#include <memory>
#include <opencv2/core.hpp>
#include <string>

#include "core/bytes.h"
#include "core/result.h"
#include "photo/decoder_wire.h"
#include "photo/photo_check.h"
#include "photo/shared_memory.h"

namespace skein {

struct DecoderOptions {
  std::string program;   // "": skein-decoder beside this program
  int max_cpu_s = 20;    // of one photo; and as much again for each 20 megapixels
  int max_still_s = 30;  // without an answer and without use of the processor
};

// Decodes photos in a child process, which can do no more than that: it has no files, no network,
// no threads (codecs/confinement.h), and of memory and processor time what a photo of the claimed
// size needs. A photo on which the child ends is an error like any other photo that cannot be
// decoded; a new child starts for the next one.
//
// Errors are kUnavailable where the photo is not to blame: no child can be started, or it was
// killed from outside (SIGKILL, as by a kernel without memory). Then a later try may succeed.
//
// One thread at a time, and one that outlives this object: the child ends with the thread that
// started it.
class PhotoDecoder {
 public:
  // Starts the first child. An error says why there is none.
  static Result<std::unique_ptr<PhotoDecoder>> Start(DecoderOptions options = DecoderOptions());
  ~PhotoDecoder();

  // CheckHeader in this process; then decodes the whole photo and reads EXIF in the child. An error
  // that is not kUnavailable is the reason that the agent gets.
  Result<CheckedPhoto> Check(const Bytes& photo, const PhotoLimits& limits);

  // 8-bit BGR, pixels as stored (codecs/image_decoding.h). The image lies in memory that is used
  // again: it is valid until the next call.
  Result<cv::Mat> Decode(const Bytes& photo, int64_t max_pixels = 400'000'000);

 private:
  class Child;

  PhotoDecoder(DecoderOptions options, SharedMemory input, SharedMemory output);
  Status StartChild();
  Result<DecoderAnswer> Ask(DecoderRequest::Kind kind, const PhotoHeader& header,
                            const Bytes& photo, size_t output_bytes);
  Status Give(const DecoderRequest& request);

  const DecoderOptions options_;
  SharedMemory input_, output_;
  std::unique_ptr<Child> child_;  // null: ended
};

}  // namespace skein
