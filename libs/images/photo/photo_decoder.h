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

struct DecodedPhoto {
  // 8-bit BGR, pixels as stored (codecs/image_decoding.h). The pixels lie in memory that is used
  // again: the image is valid until the next call.
  cv::Mat image;
  PhotoHeader header;
  int reduction = 1;  // the image's sides are 1 / reduction of the header's, rounded up
};

// Bounds of one photo; only tests have narrower ones.
struct DecoderBounds {
  int max_cpu_s = 20;    // and as much again for each 20 megapixels
  int max_still_s = 30;  // without an answer and without use of the processor
};

struct DecoderOptions {
  std::string program;  // "": skein-decoder beside this program
  DecoderBounds bounds;
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

  // No more of it than it takes for an image whose longest side is `min_side_px` or more; 0: all.
  Result<DecodedPhoto> Decode(const Bytes& photo, int64_t min_side_px = 0,
                              int64_t max_pixels = 400'000'000);

 private:
  class Child;

  PhotoDecoder(DecoderOptions options, SharedMemory input, SharedMemory output);
  Status StartChild();
  Result<DecoderAnswer> Ask(const DecoderRequest& request, const Bytes& photo);
  Status Give(const DecoderRequest& request);

  const DecoderOptions options_;
  SharedMemory input_, output_;
  std::unique_ptr<Child> child_;  // null: ended
};

}  // namespace skein
