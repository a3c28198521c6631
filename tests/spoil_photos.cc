// Photos spoiled as photographers spoil them, from good ones. Each is called KIND-N.jpg.
//
//   spoil_photos GOOD OTHER OUT
//
//   GOOD   folder of photos of the place, at least 18
//   OTHER  folder of photos of places that overlap neither each other nor the place, at least 6
//
// blur, motion, dark, cap (a covered lens), thumb (a finger over nine tenths of the photo): of
// GOOD. other: of OTHER. turn: a camera that only turns, of one photo of OTHER.
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "codecs/photo_encoding.h"
#include "core/file.h"
#include "core/folder.h"

namespace fs = std::filesystem;

namespace {

using Spoil = std::function<cv::Mat(const cv::Mat&, int)>;

std::vector<fs::path> PhotosIn(const fs::path& folder, size_t at_least) {
  std::vector<fs::path> photos = skein::FilesUnder(folder);
  if (photos.size() >= at_least) return photos;
  throw std::runtime_error(folder.string() + ": give " + std::to_string(at_least) + " photos");
}

double FocalPx(const cv::Mat& photo) { return 0.86 * photo.cols; }  // of skein sim's photos

void AddNoise(cv::Mat* photo, double sigma, int seed) {
  cv::Mat noise(photo->size(), CV_16SC3), sum;
  cv::RNG random(static_cast<uint64_t>(seed) + 1);
  random.fill(noise, cv::RNG::NORMAL, 0, sigma);
  photo->convertTo(sum, CV_16SC3);
  sum += noise;
  sum.convertTo(*photo, CV_8UC3);
}

cv::Mat Blur(const cv::Mat& photo, int n) {
  cv::Mat blurred;
  cv::GaussianBlur(photo, blurred, {}, photo.cols * (0.012 + 0.002 * n));
  AddNoise(&blurred, 1.5, n);
  return blurred;
}

cv::Mat Motion(const cv::Mat& photo, int n) {
  const int length = photo.cols / 8 + n * photo.cols / 40;
  cv::Mat blurred;
  cv::blur(photo, blurred, n % 2 == 0 ? cv::Size(length, 1) : cv::Size(length / 4, length));
  AddNoise(&blurred, 1.5, n);
  return blurred;
}

cv::Mat Dark(const cv::Mat& photo, int n) {
  cv::Mat dark = photo * (0.02 + 0.01 * n);
  AddNoise(&dark, 2, n);
  return dark;
}

cv::Mat Cap(const cv::Mat& photo, int n) {
  cv::Mat black(photo.size(), CV_8UC3, cv::Scalar::all(1 + n));
  AddNoise(&black, 1.5, n);
  return black;
}

cv::Mat Thumb(const cv::Mat& photo, int n) {
  cv::Mat1f cover(photo.size(), 0.F);
  const cv::Point corner(n % 2 == 0 ? 0 : photo.cols, n < 2 ? 0 : photo.rows);
  cv::ellipse(cover, corner, {photo.cols * 115 / 100, photo.rows * 130 / 100}, 0, 0, 360, 1, -1);
  cv::GaussianBlur(cover, cover, {}, photo.cols / 40.0);
  cv::Mat covered = photo.clone();
  covered.forEach<cv::Vec3b>([&](cv::Vec3b& pixel, const int at[]) {
    const float share = cover(at[0], at[1]);
    for (int c = 0; c < 3; ++c) {
      pixel[c] = cv::saturate_cast<uint8_t>((1 - share) * pixel[c] + share * (90 + 30 * c));
    }
  });
  AddNoise(&covered, 1.5, n);
  return covered;
}

// Homography of a turn about the vertical: K R K^-1, of a lens without distortion.
cv::Mat Turn(const cv::Mat& photo, int n) {
  const double focal = FocalPx(photo), angle = 0.07 * (n - 2);
  const cv::Matx33d K(focal, 0, photo.cols / 2.0, 0, focal, photo.rows / 2.0, 0, 0, 1);
  const cv::Matx33d R(std::cos(angle), 0, std::sin(angle), 0, 1, 0, -std::sin(angle), 0,
                      std::cos(angle));
  cv::Mat turned;
  cv::warpPerspective(photo, turned, K * R * K.inv(), photo.size(), cv::INTER_CUBIC,
                      cv::BORDER_REFLECT);
  const cv::Rect middle(photo.cols / 6, photo.rows / 6, photo.cols * 2 / 3, photo.rows * 2 / 3);
  return turned(middle).clone();
}

void Write(const fs::path& file, const cv::Mat& photo, double focal_px) {
  skein::ExifInfo info;
  info.make = "Skein";
  info.model = file.filename().string().substr(0, file.filename().string().find('-'));
  info.width = photo.cols;
  info.height = photo.rows;
  info.focal_35mm = static_cast<int>(std::lround(focal_px * 36 / photo.cols));
  const auto bytes = skein::EncodePhoto(photo, &info, 92);
  const skein::Status status = skein::WriteFileAtomic(file.string(), bytes.data(), bytes.size());
  if (!status.ok()) throw std::runtime_error(status.error());
}

struct Kind {
  const char* name;
  int count;
  Spoil spoil;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    std::fprintf(stderr, "usage: spoil_photos GOOD OTHER OUT\n");
    return 2;
  }
  try {
    const std::vector<fs::path> good = PhotosIn(argv[1], 18), other = PhotosIn(argv[2], 6);
    const fs::path out = argv[3];
    fs::create_directories(out);
    size_t next = 0;
    for (const Kind& kind : std::vector<Kind>{{"blur", 5, Blur},
                                              {"motion", 4, Motion},
                                              {"dark", 5, Dark},
                                              {"cap", 3, Cap},
                                              {"thumb", 4, Thumb}}) {
      for (int n = 0; n < kind.count; ++n) {
        const cv::Mat photo = cv::imread(good[next++ % good.size()].string());
        Write(out / (kind.name + ("-" + std::to_string(n)) + ".jpg"), kind.spoil(photo, n),
              FocalPx(photo));
      }
    }
    for (int n = 0; n < 5; ++n) {
      const cv::Mat photo = cv::imread(other[n].string());
      Write(out / ("other-" + std::to_string(n) + ".jpg"), photo, FocalPx(photo));
    }
    const cv::Mat still = cv::imread(other[5].string());
    for (int n = 0; n < 4; ++n) {
      Write(out / ("turn-" + std::to_string(n) + ".jpg"), Turn(still, n), FocalPx(still));
    }
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "spoil_photos: %s\n", error.what());
    return 1;
  }
}
