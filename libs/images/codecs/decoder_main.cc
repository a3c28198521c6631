// skein-decoder: decodes the photos that a PhotoDecoder (photo/photo_decoder.h) hands to it,
// confined.
#include <fcntl.h>
#include <malloc.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <exception>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>
#include <string>

#include "codecs/check_photo.h"
#include "codecs/confinement.h"
#include "codecs/decode_check.h"
#include "codecs/exif_reader.h"
#include "codecs/image_decoding.h"
#include "photo/decoder_wire.h"

namespace skein {
namespace {

constexpr size_t kPage = 4096;
// Larger blocks go back to the system when they are freed: the limit of the next photo is its own.
constexpr int kMmapThreshold = 1 << 20;
constexpr char kOomScore[] = "500";

// The parent's memory, as much of it as a photo needs.
class Mapping {
 public:
  Mapping(int fd, int protection) : fd_(fd), protection_(protection) {}

  uint8_t* Map(size_t size) {
    if (size <= size_) return data_;
    if (data_ != nullptr) munmap(data_, size_);
    size_ = 0;
    data_ = nullptr;
    const size_t pages = (size + kPage - 1) / kPage * kPage;
    void* mapped = mmap(nullptr, pages, protection_, MAP_SHARED, fd_, 0);
    if (mapped == MAP_FAILED) throw std::bad_alloc();
    data_ = static_cast<uint8_t*>(mapped);
    size_ = pages;
    return data_;
  }

 private:
  const int fd_;
  const int protection_;
  uint8_t* data_ = nullptr;
  size_t size_ = 0;
};

class Decoder {
 public:
  DecoderAnswer Answer(const DecoderRequest& request) {
    DecoderAnswer answer;
    try {
      const ByteView photo(input_.Map(request.photo_bytes), request.photo_bytes);
      if (request.kind == DecoderRequest::Kind::kDecode) {
        answer.status = Decode(photo, request);
      } else {
        answer.status = CheckDecodes(photo, request.header);
        if (answer.status.ok()) answer.exif = ReadExif(photo, request.header);
      }
    } catch (const std::bad_alloc&) {
      answer.status = ResourceExhausted("needs more memory than a photo of its size may take");
    } catch (const std::exception& error) {
      answer.status = DataLoss(std::string("cannot be decoded: ") + error.what());
    }
    return answer;
  }

 private:
  Status Decode(ByteView photo, const DecoderRequest& request) {
    return DecodePhotoInto(request.header, photo, request.reduction,
                           output_.Map(DecodedBytes(request)));
  }

  Mapping input_{kDecoderInput, PROT_READ};
  Mapping output_{kDecoderOutput, PROT_READ | PROT_WRITE};
};

// Once through each codec, so that what a library opens on its first use is open.
void WarmUp() {
  cv::setNumThreads(0);
  tzset();
  const cv::Mat grey(64, 64, CV_8UC1, cv::Scalar(9));
  for (const char* extension : {".jpg", ".png", ".tiff"}) {
    Bytes photo;
    cv::imencode(extension, grey, photo);
    const Result<CheckedPhoto> checked = CheckPhoto(photo, PhotoLimits());
    if (!checked.ok()) throw std::runtime_error(checked.error());
    const Result<cv::Mat> image = DecodePhoto(photo);
    if (!image.ok()) throw std::runtime_error(image.error());
  }
}

// Address space in use, bytes.
uint64_t AddressSpace() {
  uint64_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  if (pages == 0) throw std::runtime_error("cannot read /proc/self/statm");
  return pages * static_cast<uint64_t>(sysconf(_SC_PAGESIZE));
}

void Silence() {
  const int null = open("/dev/null", O_WRONLY | O_CLOEXEC);
  if (null < 0) throw std::runtime_error("cannot open /dev/null");
  dup2(null, STDOUT_FILENO);
  dup2(null, STDERR_FILENO);
}

void Send(const DecoderAnswer& answer) {
  const Bytes message = EncodeDecoderAnswer(answer);
  if (write(kDecoderSocket, message.data(), message.size()) < 0) _exit(1);
}

// Until the parent closes its end.
void Serve(Decoder* decoder) {
  Bytes message(kMaxDecoderMessage);
  while (true) {
    const ssize_t size = read(kDecoderSocket, message.data(), message.size());
    if (size < 0 && errno == EINTR) continue;
    if (size <= 0) return;
    const Result<DecoderRequest> request =
        ParseDecoderRequest(message.data(), static_cast<size_t>(size));
    DecoderAnswer answer;
    if (request.ok()) {
      answer = decoder->Answer(*request);
    } else {
      answer.status = request.status();
    }
    Send(answer);
  }
}

DecoderAnswer Prepare() {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  mallopt(M_MMAP_THRESHOLD, kMmapThreshold);
  mallopt(M_TRIM_THRESHOLD, kMmapThreshold);
  DecoderAnswer ready;
  try {
    std::ofstream("/proc/self/oom_score_adj") << kOomScore;
    WarmUp();
    ready.address_space_bytes = AddressSpace();
    Silence();
    ready.status = ConfineThisProcess(kDecoderSocket);
  } catch (const std::exception& error) {
    ready.status = Unavailable(error.what());
  }
  return ready;
}

bool IsStartedByAParent() {
  for (const int fd : {kDecoderSocket, kDecoderInput, kDecoderOutput}) {
    if (fcntl(fd, F_GETFD) < 0) return false;
  }
  return true;
}

}  // namespace
}  // namespace skein

int main() {
  if (!skein::IsStartedByAParent()) {
    std::fprintf(stderr,
                 "skein-decoder: skein-ingest and skein-features start it to decode photos; it is "
                 "of no use by itself\n");
    return 2;
  }
  const skein::DecoderAnswer ready = skein::Prepare();
  skein::Send(ready);
  skein::Decoder decoder;
  if (ready.status.ok()) skein::Serve(&decoder);
  _exit(0);
}
