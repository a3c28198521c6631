// bad_photos GOOD OUTPUT: writes odd and bad files made of the good photos in folder GOOD.
//
// OUTPUT/odd: unusual photos that must be reconstructed: grey, 16 bits, CMYK, rotated by EXIF.
// OUTPUT/bad: photos that must be refused or set aside. OUTPUT/twice/NAME: another content under
// the name of a good photo.
#include <cstdio>
// jpeglib.h needs FILE and size_t.
#include <jpeglib.h>

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <memory>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "core/file.h"
#include "testing/test_photos.h"

namespace skein {
namespace {

namespace fs = std::filesystem;
using FilePtr = std::unique_ptr<std::FILE, int (*)(std::FILE*)>;

void Write(const fs::path& path, const Bytes& bytes) {
  fs::create_directories(path.parent_path());
  if (const Status status = WriteFileAtomic(path.string(), bytes); !status.ok()) {
    throw std::runtime_error(status.error());
  }
}

// As Adobe writes it: inverted, black unused. OpenCV can't write CMYK.
void WriteCmykJpeg(const fs::path& path, const cv::Mat& bgr) {
  const FilePtr file(std::fopen(path.c_str(), "wb"), std::fclose);
  if (!file) throw std::runtime_error("cannot write " + path.string());
  jpeg_error_mgr errors;
  jpeg_compress_struct info;
  info.err = jpeg_std_error(&errors);
  jpeg_create_compress(&info);
  jpeg_stdio_dest(&info, file.get());
  info.image_width = static_cast<JDIMENSION>(bgr.cols);
  info.image_height = static_cast<JDIMENSION>(bgr.rows);
  info.input_components = 4;
  info.in_color_space = JCS_CMYK;
  jpeg_set_defaults(&info);
  jpeg_set_quality(&info, 95, TRUE);
  jpeg_start_compress(&info, TRUE);
  std::vector<JSAMPLE> row(static_cast<size_t>(bgr.cols) * 4);
  for (int y = 0; y < bgr.rows; ++y) {
    for (int x = 0; x < bgr.cols; ++x) {
      const auto& pixel = bgr.at<cv::Vec3b>(y, x);
      const JSAMPLE cmyk[] = {pixel[2], pixel[1], pixel[0], 255};
      std::copy(cmyk, cmyk + 4, &row[static_cast<size_t>(x) * 4]);
    }
    JSAMPROW pointer = row.data();
    jpeg_write_scanlines(&info, &pointer, 1);
  }
  jpeg_finish_compress(&info);
  jpeg_destroy_compress(&info);
}

void WriteOddPhotos(const std::vector<fs::path>& good, const fs::path& out) {
  const auto read = [&](size_t i) { return cv::imread(good.at(i).string()); };
  fs::create_directories(out);
  cv::Mat grey, deep;
  cv::cvtColor(read(0), grey, cv::COLOR_BGR2GRAY);
  Write(out / "grey.jpg", Encode(grey, ".jpg"));
  read(1).convertTo(deep, CV_16U, 257);
  Write(out / "sixteen-bit.png", Encode(deep, ".png"));
  WriteCmykJpeg(out / "cmyk.jpg", read(2));
  ExifBuilder turned;
  turned.Short(0, 0x0112, 6);
  Write(out / "turned.jpg", turned.Into(Encode(read(3), ".jpg")));
}

void WriteBadPhotos(const fs::path& photo, const fs::path& out) {
  const Bytes good = *ReadFile(photo.string());
  Bytes damaged = good;
  std::fill(damaged.begin() + static_cast<long>(good.size() / 2),
            damaged.begin() + static_cast<long>(good.size() / 2 + 2000), uint8_t{0xff});
  const std::string text = "no photo at all";
  Write(out / "truncated.jpg",
        Bytes(good.begin(), good.begin() + static_cast<long>(good.size() / 2)));
  Write(out / "corrupt.jpg", damaged);
  Write(out / "empty.jpg", {});
  Write(out / "dot.png", Encode(Noise(1, 1), ".png"));
  Write(out / "text.jpg", Bytes(text.begin(), text.end()));
  Write(out / "bomb.jpg", WithClaimedSize(SmallJpeg(), 60000, 60000));
  Write(out / "flat.jpg", Encode(cv::Mat(480, 640, CV_8UC3, cv::Scalar(120, 130, 140)), ".jpg"));
  Write(out / "again.jpg", good);
}

int Run(const fs::path& good_folder, const fs::path& out) {
  std::vector<fs::path> good;
  for (const auto& entry : fs::directory_iterator(good_folder)) good.push_back(entry.path());
  std::sort(good.begin(), good.end());
  WriteOddPhotos(good, out / "odd");
  WriteBadPhotos(good.at(0), out / "bad");
  Write(out / "twice" / good.at(0).filename(), Encode(cv::imread(good.at(4).string()), ".jpg"));
  return 0;
}

}  // namespace
}  // namespace skein

int main(int argc, char** argv) {
  if (argc != 3) {
    std::cerr << "bad_photos GOOD OUTPUT\n";
    return 2;
  }
  try {
    return skein::Run(argv[1], argv[2]);
  } catch (const std::exception& error) {
    std::cerr << "bad_photos: " << error.what() << '\n';
    return 1;
  }
}
