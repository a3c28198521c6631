#include "photo/photo_decoder.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <map>
#include <opencv2/imgproc.hpp>
#include <thread>

#include "testing/test_bombs.h"
#include "testing/test_decoder.h"
#include "testing/test_photos.h"

namespace skein::photo_decoder_test {

namespace fs = std::filesystem;

std::unique_ptr<PhotoDecoder> StartDecoder(const DecoderOptions& options = DecoderOptions()) {
  auto decoder = PhotoDecoder::Start(options);
  if (!decoder.ok()) throw std::runtime_error(decoder.error());
  return *std::move(decoder);
}

// The real one's process, a child of this one; 0 if there is none.
pid_t DecoderProcess() {
  for (const auto& entry : fs::directory_iterator("/proc")) {
    std::ifstream stat(entry.path() / "stat");
    std::string pid, name, state;
    pid_t parent = 0;
    if (!(stat >> pid >> name >> state >> parent)) continue;
    if (parent != getpid() || name != "(skein-decoder)") continue;
    // A thread that outlives the first one keeps the socket open.
    constexpr int kFieldsBetween = 15;
    std::string skipped;
    for (int i = 0; i < kFieldsBetween; ++i) stat >> skipped;
    int num_threads = 0;
    stat >> num_threads;
    if (state != "Z" || num_threads > 1) return std::stoi(pid);
  }
  return 0;
}

Status CheckWith(const std::string& how) {
  const FaultyDecoder faulty(how);
  const auto decoder = StartDecoder(faulty.options);
  const Status first = decoder->Check(SmallJpeg(), PhotoLimits()).status();
  const Status second = decoder->Check(SmallJpeg(), PhotoLimits()).status();
  EXPECT_EQ(first.text, second.text) << "a new decoder must have seen the second photo";
  return first;
}

void Kill(pid_t process, int signal) { ASSERT_EQ(kill(process, signal), 0); }

double CpuS(pid_t process) {
  clockid_t clock = 0;
  timespec time{};
  clock_getcpuclockid(process, &clock);
  clock_gettime(clock, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

// Ends the decoder by the signal as soon as it has worked a while, if it does while this lives.
class Killer {
 public:
  Killer(pid_t process, int signal)
      : thread_([this, process, signal, begin_s = CpuS(process)] {
          while (!stop_ && CpuS(process) < begin_s + 0.02) {
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
          }
          if (!stop_) kill(process, signal);
        }) {}
  ~Killer() {
    stop_ = true;
    thread_.join();
  }

 private:
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

// What comes of a photo while the decoder is ended by the signal. On a busy machine the signal may
// come too late for a photo: then with the next.
Status EndedBy(int signal, PhotoDecoder* decoder, const Bytes& photo) {
  Status status;
  for (int i = 0; i < 50 && status.ok(); ++i) {
    const pid_t process = DecoderProcess();
    // Where the last signal came right after the answer there is none: this photo starts another.
    const auto killer = process == 0 ? nullptr : std::make_unique<Killer>(process, signal);
    status = decoder->Check(photo, PhotoLimits()).status();
  }
  return status;
}

TEST(PhotoDecoder, ReadsWhatAPhotoSays) {
  ExifBuilder exif;
  exif.Ascii(0, 0x010f, "Canon");
  exif.Ascii(0, 0x0110, "Canon EOS 5D Mark II");
  exif.Short(0, 0x0112, 6);
  exif.Rationals(1, 0x920a, {{50, 1}});
  exif.Ascii(1, 0x9003, "2009:02:14 00:31:30");
  exif.Ascii(2, 1, "S");
  exif.Rationals(2, 2, {{33, 1}, {30, 1}, {36, 1}});
  exif.Ascii(2, 3, "E");
  exif.Rationals(2, 4, {{151, 1}, {15, 1}, {0, 1}});
  const auto photo = StartDecoder()->Check(exif.Into(SmallJpeg(1, 1600, 1200)), PhotoLimits());
  ASSERT_TRUE(photo.ok()) << photo.error();
  EXPECT_EQ(photo->header.width_px, 1600);
  EXPECT_EQ(photo->exif.make, "Canon");
  EXPECT_EQ(photo->exif.orientation, 6);
  EXPECT_NEAR(photo->exif.focal_px.value_or(0), 50.0 / 36 * 1600, 20);
  EXPECT_EQ(photo->exif.capture_utime_us, 1234571490000000);
  ASSERT_TRUE(photo->exif.gps);
  EXPECT_NEAR(photo->exif.gps->latitude_deg, -33.51, 1e-9);
}

TEST(PhotoDecoder, DecodesPhotosOfOneSizeAfterAnother) {
  const auto decoder = StartDecoder();
  for (const cv::Size size : {cv::Size(96, 80), {3000, 2000}, {64, 64}, {1, 1}, {3001, 2003}}) {
    for (const std::string extension : {".png", ".tiff"}) {
      const cv::Mat image = Noise(size.width, size.height, CV_8UC3, size.width);
      const auto decoded = decoder->Decode(Encode(image, extension));
      ASSERT_TRUE(decoded.ok()) << decoded.error();
      ASSERT_EQ(decoded->image.size(), image.size());
      EXPECT_EQ(cv::norm(decoded->image, image, cv::NORM_INF), 0) << extension << image.size();
    }
  }
}

TEST(PhotoDecoder, DecodesNoMoreOfAJpegThanIsWanted) {
  const auto decoder = StartDecoder();
  const cv::Size size(1001, 600);
  cv::Mat image = Noise(size.width / 50, size.height / 50);
  cv::resize(image, image, size, 0, 0, cv::INTER_CUBIC);
  const std::map<int64_t, int> reductions = {{0, 1},   {502, 1}, {501, 2}, {252, 2},
                                             {251, 4}, {127, 4}, {126, 8}, {1, 8}};
  for (const auto& [min_side_px, reduction] : reductions) {
    const auto decoded = decoder->Decode(Encode(image, ".jpg"), min_side_px);
    ASSERT_TRUE(decoded.ok()) << decoded.error();
    EXPECT_EQ(decoded->reduction, reduction) << min_side_px;
    EXPECT_EQ(decoded->header.width_px, size.width);
    const cv::Size reduced((size.width + reduction - 1) / reduction, size.height / reduction);
    ASSERT_EQ(decoded->image.size(), reduced);
    cv::Mat whole, wanted;  // blocks at the edge are filled up
    cv::copyMakeBorder(image, whole, 0, 0, 0, reduction * reduced.width - size.width,
                       cv::BORDER_REPLICATE);
    cv::resize(whole, wanted, reduced, 0, 0, cv::INTER_AREA);
    EXPECT_LT(cv::norm(decoded->image, wanted, cv::NORM_L1) / (3.0 * reduced.area()), 2);
  }
  const auto png = decoder->Decode(Encode(image, ".png"), 1);
  ASSERT_TRUE(png.ok()) << png.error();
  EXPECT_EQ(png->image.size(), size);
}

TEST(PhotoDecoder, ConvertsGreyAnd16Bit) {
  const auto decoder = StartDecoder();
  const auto grey = decoder->Decode(Encode(cv::Mat(9, 7, CV_8UC1, cv::Scalar(77)), ".png"));
  ASSERT_TRUE(grey.ok());
  EXPECT_EQ(grey->image.at<cv::Vec3b>(3, 3), cv::Vec3b(77, 77, 77));
  for (const std::string extension : {".png", ".tiff"}) {
    const auto deep =
        decoder->Decode(Encode(cv::Mat(9, 7, CV_16UC3, cv::Scalar::all(256 * 50)), extension));
    ASSERT_TRUE(deep.ok()) << deep.error();
    EXPECT_NEAR(deep->image.at<cv::Vec3b>(3, 3)[0], 50, 1);
  }
}

TEST(PhotoDecoder, DecodesAPhotoAtTheLimit) {
  const Bytes photo = Encode(cv::Mat(10000, 10000, CV_8UC3, cv::Scalar::all(3)), ".jpg");
  const auto decoder = StartDecoder();
  const auto checked = decoder->Check(photo, PhotoLimits());
  EXPECT_TRUE(checked.ok()) << checked.error();
  const auto image = decoder->Decode(photo);
  ASSERT_TRUE(image.ok()) << image.error();
  EXPECT_EQ(image->image.at<cv::Vec3b>(9999, 9999), cv::Vec3b(3, 3, 3));
}

TEST(PhotoDecoder, RefusesByTheHeaderWithoutDecoding) {
  // A decoder that is asked crashes.
  const FaultyDecoder faulty("crash");
  const auto decoder = StartDecoder(faulty.options);
  Bytes png = Encode(Noise(96, 80), ".png");
  const Bytes hundred_thousand = {0x00, 0x01, 0x86, 0xa0};
  std::copy(hundred_thousand.begin(), hundred_thousand.end(), png.begin() + 16);
  std::copy(hundred_thousand.begin(), hundred_thousand.end(), png.begin() + 20);
  EXPECT_EQ(decoder->Check(png, PhotoLimits()).error(),
            "header claims 100000 x 100000 pixels, more than 100 megapixels");
  EXPECT_EQ(decoder->Decode(png).error(),
            "header claims 100000 x 100000 pixels, more than 400 megapixels");
  EXPECT_EQ(decoder->Check({}, PhotoLimits()).error(), "empty file");
  EXPECT_EQ(decoder->Check({'t', 'e', 'x', 't'}, PhotoLimits()).error(),
            "not a JPEG, PNG or TIFF photo");
  EXPECT_NE(decoder->Check(SmallJpeg(), PhotoLimits()).error().find("SIGSEGV"), std::string::npos);
}

// Damage must reach no system call that the decoder may not make.
TEST(PhotoDecoder, NeverEndsOnDamagedPhotos) {
  const auto decoder = StartDecoder();
  const pid_t process = DecoderProcess();
  for (const std::string extension : {".jpg", ".png", ".tiff"}) {
    const Bytes whole = Encode(Noise(96, 80), extension);
    for (size_t at = 0; at < whole.size(); at += 1 + at / 40) {
      Bytes damaged = whole;
      damaged[at] ^= 0xff;
      const Bytes cut(whole.begin(), whole.begin() + static_cast<ptrdiff_t>(at));
      for (const Bytes& photo : {damaged, cut}) {
        EXPECT_EQ(decoder->Check(photo, PhotoLimits()).error().find("the decoder"),
                  std::string::npos)
            << extension << " at " << at;
        EXPECT_EQ(decoder->Decode(photo).error().find("the decoder"), std::string::npos)
            << extension << " at " << at;
      }
    }
  }
  EXPECT_EQ(DecoderProcess(), process);
}

TEST(PhotoDecoder, ACrashCostsOnePhoto) {
  const Bytes large = Encode(Noise(4000, 3000), ".png");
  const auto decoder = StartDecoder();
  const pid_t first = DecoderProcess();
  ASSERT_NE(first, 0);
  const Status status = EndedBy(SIGSEGV, decoder.get(), large);
  EXPECT_EQ(status.text, "the decoder ended by SIGSEGV");
  EXPECT_EQ(status.code, StatusCode::kDataLoss);
  EXPECT_TRUE(decoder->Check(large, PhotoLimits()).ok());
  EXPECT_NE(DecoderProcess(), first);
}

TEST(PhotoDecoder, APhotoIsNotToBlameForAKillFromOutside) {
  const Bytes large = Encode(Noise(4000, 3000), ".png");
  const auto decoder = StartDecoder();
  const Status status = EndedBy(SIGKILL, decoder.get(), large);
  EXPECT_EQ(status.text, "the decoder ended by SIGKILL");
  EXPECT_EQ(status.code, StatusCode::kUnavailable);
  EXPECT_TRUE(decoder->Check(large, PhotoLimits()).ok());
  Kill(DecoderProcess(), SIGKILL);
  while (DecoderProcess() != 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_TRUE(decoder->Check(large, PhotoLimits()).ok()) << "one that ended is replaced";
}

TEST(PhotoDecoder, TellsHowADecoderFailed) {
  EXPECT_EQ(CheckWith("crash").text, "the decoder ended by SIGSEGV");
  EXPECT_EQ(CheckWith("abort").text, "the decoder ended by SIGABRT");
  EXPECT_EQ(CheckWith("exit").text, "the decoder ended with exit code 3");
  EXPECT_EQ(CheckWith("babble").text, "not a message of this build's decoder");
  EXPECT_EQ(CheckWith("lie").text, "not a message of this build's decoder");
}

TEST(PhotoDecoder, EndsADecoderThatHangs) {
  EXPECT_EQ(CheckWith("sleep").text, "the decoder did nothing for 2 s");
  const Status spun = CheckWith("spin");
  EXPECT_EQ(spun.text, "the decoder took too much processor time");
  EXPECT_EQ(spun.code, StatusCode::kDataLoss);
}

TEST(PhotoDecoder, LimitsMemoryByThePhotosSize) {
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "AddressSanitizer reserves terabytes";
#endif
  const FaultyDecoder faulty("eat");
  const auto decoder = StartDecoder(faulty.options);
  const int small = std::stoi(decoder->Check(SmallJpeg(), PhotoLimits()).error());
  const Bytes large = Encode(cv::Mat(5000, 4000, CV_8UC3, cv::Scalar::all(3)), ".jpg");
  const int more = std::stoi(decoder->Decode(large).error());
  EXPECT_GT(small, 100);
  EXPECT_LT(small, 140);
  EXPECT_GT(more, small);
  EXPECT_LT(more, 1000);
}

// More than a decoder may have, from a file of 300 kB.
TEST(PhotoDecoder, ChunksThatInflateToMuchAreNotTakenIntoMemory) {
  const Bytes plain = Encode(Noise(96, 80), ".png");
  const Bytes zeros = DeflatedZeros(size_t{256} << 20);
  const auto decoder = StartDecoder();
  const pid_t process = DecoderProcess();
  for (const char* type : {"zTXt", "iTXt", "iCCP"}) {
    const Bytes photo = WithPngChunks(plain, PngBomb(type, zeros));
    EXPECT_EQ(decoder->Check(photo, PhotoLimits()).error(), "") << type;
    EXPECT_EQ(decoder->Decode(photo).error(), "") << type;
  }
  EXPECT_EQ(DecoderProcess(), process);
}

TEST(PhotoDecoder, TextsThatCostMostAreFew) {
  const Bytes text = PngBomb("zTXt", DeflatedZeros(7'900'000));  // libpng takes 8 MB
  Bytes texts;
  for (int i = 0; i < kMaxPngTexts; ++i) texts.insert(texts.end(), text.begin(), text.end());
  const Bytes plain = Encode(Noise(96, 80), ".png");
  const auto decoder = StartDecoder();
  EXPECT_EQ(decoder->Check(WithPngChunks(plain, texts), PhotoLimits()).error(), "");
  texts.insert(texts.end(), text.begin(), text.end());
  EXPECT_EQ(decoder->Check(WithPngChunks(plain, texts), PhotoLimits()).error(),
            "the PNG has more than 32 compressed texts");
}

TEST(PhotoDecoder, SegmentsWithoutEndAndDirectoriesInACircleEnd) {
  const auto decoder = StartDecoder();
  const pid_t process = DecoderProcess();
  const Bytes segments = WithJpegComments(SmallJpeg(), 100'000);
  EXPECT_EQ(decoder->Check(segments, PhotoLimits()).error(), "");
  EXPECT_EQ(decoder->Decode(segments).error(), "");
  const Bytes looped = LoopedTiff(64);
  EXPECT_EQ(decoder->Check(looped, PhotoLimits()).error(), "");
  EXPECT_EQ(decoder->Decode(looped).error(), "");
  EXPECT_EQ(DecoderProcess(), process);
}

TEST(PhotoDecoder, SaysWhyThereIsNone) {
  DecoderOptions options;
  options.program = "/nowhere/skein-decoder";
  const Status missing = PhotoDecoder::Start(options).status();
  EXPECT_NE(missing.text.find("cannot start /nowhere/skein-decoder: No such file"),
            std::string::npos)
      << missing.text;
  EXPECT_EQ(missing.code, StatusCode::kUnavailable);
  options.program = "/bin/true";
  EXPECT_EQ(PhotoDecoder::Start(options).error(),
            "/bin/true does not start: the decoder ended with exit code 0");
}

TEST(PhotoDecoder, LeavesNoProcessBehind) {
  StartDecoder();
  EXPECT_EQ(DecoderProcess(), 0);
}

}  // namespace skein::photo_decoder_test
