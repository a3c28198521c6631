// A capture of another kind, of photos that are there.
//
//   make_capture KIND OUT PHOTO...
//
// Writes OUT/NAME.jpg for each PHOTO of that name, with the photo's EXIF unless KIND says
// otherwise.
//
//   half              half of both sides
//   quality-50        JPEG quality 50; that of the other kinds is 95
//   exposure          half and twice the exposure, in turn
//   low-contrast      a fifth of the contrast, as through fog or water, with noise
//   zoom              the middle of the photo, 1 to 1.6 times enlarged; EXIF does not tell it
//   zoom-no-exif      the same without EXIF
//   overlay           text at one place in all photos
//   orientations      stored with the EXIF orientations 1 to 8 in turn, mirrored ones, too
//   bursts            each third photo comes three times, also as NAME-b1.jpg and NAME-b2.jpg
//   rotation          OUT/NAME-t00.jpg to -t11.jpg: a camera that only turns, EXIF tells its focal
//   length rotation-no-exif  the same without EXIF
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "benchmark/captures/variants.h"
#include "codecs/check_photo.h"
#include "codecs/image_decoding.h"
#include "codecs/photo_encoding.h"
#include "core/file.h"

namespace fs = std::filesystem;

namespace skein {
namespace {

constexpr int kNumTurns = 12;

struct Source {
  Bytes bytes;
  CheckedPhoto checked;
  cv::Mat3b pixels;
  Bytes exif;
  size_t index = 0;  // among the photos of the capture

  double focal_px() const { return ChooseFocal(checked, 0).focal_px; }
};

struct Shot {
  std::string suffix;  // behind the photo's name
  cv::Mat3b pixels;
  Bytes exif;
  int quality = 95;
};

using Kind = std::function<std::vector<Shot>(const Source&)>;

template <class T>
T Take(Result<T> result, const fs::path& file) {
  if (!result) throw std::runtime_error(file.string() + ": " + result.error());
  return *std::move(result);
}

Source ReadSource(const fs::path& file, size_t index) {
  Source source;
  source.index = index;
  source.bytes = Take(ReadFile(file.string()), file);
  source.checked = Take(CheckPhoto(source.bytes, {}), file);
  source.pixels = Take(DecodePhoto(source.bytes), file);
  source.exif = ExifOf(source.bytes);
  return source;
}

// Of pixels that a camera of this focal length took; unset: it is not told.
ExifInfo PlainExif(const cv::Mat3b& pixels, std::optional<double> focal_px) {
  ExifInfo info;
  info.make = "Skein";
  info.model = "capture";
  info.width = pixels.cols;
  info.height = pixels.rows;
  if (focal_px) {
    info.focal_35mm = static_cast<int>(
        std::lround(*focal_px * kFullFrameDiagonalMm / std::hypot(pixels.cols, pixels.rows)));
  }
  return info;
}

std::vector<Shot> Zoom(const Source& source, const Bytes& exif) {
  return {{"", Zoomed(source.pixels, 1 + 0.15 * static_cast<double>(source.index % 5)), exif}};
}

std::vector<Shot> Orientation(const Source& source) {
  const int orientation = static_cast<int>(source.index % 8) + 1;
  cv::Mat3b stored = StoredAs(source.pixels, orientation);
  ExifInfo info = PlainExif(stored, source.checked.exif.focal_px);
  info.orientation = orientation;
  return {{"", stored, EncodeExif(info)}};
}

std::vector<Shot> Burst(const Source& source) {
  std::vector<Shot> shots = {{"", source.pixels, source.exif}};
  for (const uint64_t n : {1, 2}) {
    if (source.index % 3 != 0) break;
    shots.push_back({"-b" + std::to_string(n),
                     BurstShot(source.pixels, source.focal_px(), 2 * source.index + n),
                     source.exif});
  }
  return shots;
}

std::vector<Shot> Rotation(const Source& source, bool with_exif) {
  const double focal_px = source.focal_px();
  const cv::Size size(source.pixels.cols / 2, source.pixels.rows / 2);
  std::vector<Shot> shots;
  for (const Turn& turn : Sweep(source.pixels.size(), focal_px, kNumTurns)) {
    char suffix[8];
    std::snprintf(suffix, sizeof suffix, "-t%02zu", shots.size());
    const cv::Mat3b view = Turned(source.pixels, focal_px, turn, size);
    shots.push_back({suffix, view, with_exif ? EncodeExif(PlainExif(view, focal_px)) : Bytes{}});
  }
  return shots;
}

const std::map<std::string, Kind>& Kinds() {
  static const std::map<std::string, Kind> kKinds = {
      {"half",
       [](const Source& s) {
         return std::vector<Shot>{{"", Half(s.pixels), s.exif}};
       }},
      {"quality-50",
       [](const Source& s) {
         return std::vector<Shot>{{"", s.pixels, s.exif, 50}};
       }},
      {"exposure",
       [](const Source& s) {
         return std::vector<Shot>{{"", Exposed(s.pixels, s.index % 2 == 0 ? 0.5 : 2), s.exif}};
       }},
      {"low-contrast",
       [](const Source& s) {
         return std::vector<Shot>{{"", Hazy(s.pixels, 0.2, s.index), s.exif}};
       }},
      {"zoom", [](const Source& s) { return Zoom(s, s.exif); }},
      {"zoom-no-exif", [](const Source& s) { return Zoom(s, {}); }},
      {"overlay",
       [](const Source& s) {
         return std::vector<Shot>{{"", Overlaid(s.pixels), s.exif}};
       }},
      {"orientations", Orientation},
      {"bursts", Burst},
      {"rotation", [](const Source& s) { return Rotation(s, true); }},
      {"rotation-no-exif", [](const Source& s) { return Rotation(s, false); }},
  };
  return kKinds;
}

void Write(const fs::path& file, const Shot& shot) {
  Bytes jpeg = EncodePhoto(shot.pixels, nullptr, shot.quality);
  if (!shot.exif.empty()) jpeg = WithExif(std::move(jpeg), shot.exif);
  const Status status = WriteFileAtomic(file.string(), jpeg);
  if (!status.ok()) throw std::runtime_error(status.error());
}

void MakeCapture(const Kind& kind, const fs::path& out, const std::vector<fs::path>& photos) {
  fs::create_directories(out);
  for (size_t i = 0; i < photos.size(); ++i) {
    for (const Shot& shot : kind(ReadSource(photos[i], i))) {
      Write(out / (photos[i].stem().string() + shot.suffix + ".jpg"), shot);
    }
  }
}

}  // namespace
}  // namespace skein

int main(int argc, char** argv) {
  const auto kind = argc < 4 ? skein::Kinds().end() : skein::Kinds().find(argv[1]);
  if (kind == skein::Kinds().end()) {
    std::fprintf(stderr, "usage: make_capture KIND OUT PHOTO...; kinds:");
    for (const auto& [name, make] : skein::Kinds()) std::fprintf(stderr, " %s", name.c_str());
    std::fprintf(stderr, "\n");
    return 2;
  }
  try {
    skein::MakeCapture(kind->second, argv[2], {argv + 3, argv + argc});
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "make_capture: %s\n", error.what());
    return 1;
  }
}
