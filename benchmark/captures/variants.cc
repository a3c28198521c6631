#include "benchmark/captures/variants.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <string>

#include "photo/exif.h"
#include "photo/image_view.h"

namespace skein {
namespace {

constexpr double kGamma = 2.2;
constexpr double kVeil = 180;  // of fog that the sky lights

void AddNoise(cv::Mat3b* photo, double sigma, uint64_t seed) {
  cv::Mat noise(photo->size(), CV_16SC3), sum;
  cv::RNG random(seed + 1);
  random.fill(noise, cv::RNG::NORMAL, 0, sigma);
  photo->convertTo(sum, CV_16SC3);
  sum += noise;
  sum.convertTo(*photo, CV_8UC3);
}

// Pixel (0, 0) of OpenCV's warps is the centre of the upper left one.
cv::Matx33d Calibration(double focal_px, cv::Size size) {
  return {focal_px, 0, (size.width - 1) / 2.0, 0, focal_px, (size.height - 1) / 2.0, 0, 0, 1};
}

// The turned camera's axes in the old camera's frame (x right, y down, z forward) are its rows.
cv::Matx33d Rotation(const Turn& turn) {
  const double cy = std::cos(turn.yaw_rad), sy = std::sin(turn.yaw_rad);
  const double cp = std::cos(turn.pitch_rad), sp = std::sin(turn.pitch_rad);
  const double cr = std::cos(turn.roll_rad), sr = std::sin(turn.roll_rad);
  const cv::Matx33d yaw(cy, 0, -sy, 0, 1, 0, sy, 0, cy);
  const cv::Matx33d pitch(1, 0, 0, 0, cp, -sp, 0, sp, cp);
  const cv::Matx33d roll(cr, sr, 0, -sr, cr, 0, 0, 0, 1);
  return roll * pitch * yaw;
}

cv::Matx33d Homography(cv::Size photo, double focal_px, const Turn& turn, cv::Size view) {
  return Calibration(focal_px, view) * Rotation(turn) * Calibration(focal_px, photo).inv();
}

bool LiesInPhoto(cv::Size photo, double focal_px, const Turn& turn, cv::Size view) {
  const cv::Matx33d photo_from_view = Homography(photo, focal_px, turn, view).inv();
  for (const double x : {0.0, view.width - 1.0}) {
    for (const double y : {0.0, view.height - 1.0}) {
      const cv::Vec3d at = photo_from_view * cv::Vec3d(x, y, 1);
      if (at[2] <= 0) return false;
      const double u = at[0] / at[2], v = at[1] / at[2];
      if (u < 0 || u > photo.width - 1 || v < 0 || v > photo.height - 1) return false;
    }
  }
  return true;
}

}  // namespace

cv::Mat3b Half(const cv::Mat3b& photo) {
  cv::Mat3b half;
  cv::resize(photo, half, {photo.cols / 2, photo.rows / 2}, 0, 0, cv::INTER_AREA);
  return half;
}

cv::Mat3b Exposed(const cv::Mat3b& photo, double factor) {
  cv::Mat3b exposed;
  photo.convertTo(exposed, CV_8UC3, std::pow(factor, 1 / kGamma));
  return exposed;
}

cv::Mat3b Hazy(const cv::Mat3b& photo, double transmission, uint64_t seed) {
  cv::Mat3b hazy;
  photo.convertTo(hazy, CV_8UC3, transmission, kVeil * (1 - transmission));
  AddNoise(&hazy, 1, seed);
  return hazy;
}

cv::Mat3b Zoomed(const cv::Mat3b& photo, double zoom) {
  const cv::Matx33d calibration = Calibration(1, photo.size());
  const cv::Matx33d homography = Calibration(zoom, photo.size()) * calibration.inv();
  cv::Mat3b zoomed;
  cv::warpPerspective(photo, zoomed, homography, photo.size(), cv::INTER_CUBIC,
                      cv::BORDER_REPLICATE);
  return zoomed;
}

cv::Mat3b Overlaid(const cv::Mat3b& photo) {
  cv::Mat3b overlaid = photo.clone();
  const double scale = photo.cols / 1000.0;
  const auto write = [&](const std::string& text, double x, double y) {
    cv::putText(overlaid, text, {cvRound(x * photo.cols), cvRound(y * photo.rows)},
                cv::FONT_HERSHEY_DUPLEX, scale, {255, 255, 255}, std::max(1, cvRound(2 * scale)),
                cv::LINE_AA);
  };
  write("2024-05-17 14:32:08 CAM 3", 0.02, 0.06);
  write("SPEED 00 KM/H GPS OK REC", 0.02, 0.11);
  write("N 48.20817 E 16.37382", 0.55, 0.92);
  write("ALT 171 M HDG 203 BAT 87%", 0.55, 0.97);
  return overlaid;
}

cv::Mat3b Turned(const cv::Mat3b& photo, double focal_px, const Turn& turn, cv::Size size) {
  cv::Mat3b turned;
  cv::warpPerspective(photo, turned, Homography(photo.size(), focal_px, turn, size), size,
                      cv::INTER_CUBIC, cv::BORDER_REPLICATE);
  return turned;
}

std::vector<Turn> Sweep(cv::Size photo, double focal_px, int num_turns) {
  const cv::Size view(photo.width / 2, photo.height / 2);
  const double yaw_rad = std::atan(photo.width / (2 * focal_px));
  const double pitch_rad = std::atan(photo.height / (2 * focal_px));
  const int columns = (num_turns + 1) / 2;
  for (double share = 1;; share *= 0.95) {
    std::vector<Turn> turns;
    for (int i = 0; i < num_turns; ++i) {
      const double right = columns > 1 ? 2.0 * (i % columns) / (columns - 1) - 1 : 0;
      const double down = i < columns ? -0.5 : 0.5;
      turns.push_back({share * yaw_rad * right, share * pitch_rad * down, 0.01 * (i % 3 - 1)});
    }
    const bool all_lie_in = std::all_of(turns.begin(), turns.end(), [&](const Turn& turn) {
      return LiesInPhoto(photo, focal_px, turn, view);
    });
    if (all_lie_in) return turns;
  }
}

cv::Mat3b BurstShot(const cv::Mat3b& photo, double focal_px, uint64_t seed) {
  constexpr double kDegree = CV_PI / 180;
  cv::RNG random(seed + 1);
  const auto tremble = [&] {
    return random.uniform(0.1, 0.3) * (random.uniform(0, 2) == 0 ? -1 : 1) * kDegree;
  };
  const double yaw_rad = tremble(), pitch_rad = tremble(), roll_rad = tremble();
  cv::Mat3b shot = Turned(photo, focal_px, {yaw_rad, pitch_rad, roll_rad}, photo.size());
  AddNoise(&shot, 2, seed);
  return shot;
}

cv::Mat3b StoredAs(const cv::Mat3b& upright, int exif_orientation) {
  const int rotation = RotationOf(exif_orientation);
  const int inverse = rotation == 6 ? 8 : rotation == 8 ? 6 : rotation;
  cv::Mat3b stored = UprightView(upright, inverse).clone();
  if (IsMirrored(exif_orientation)) cv::flip(stored, stored, 1);
  return stored;
}

Bytes ExifOf(const Bytes& photo) {
  const std::string kStart("Exif\0\0", 6);
  if (photo.size() < 4 || photo[0] != 0xff || photo[1] != 0xd8) return {};
  for (size_t at = 2; at + 4 <= photo.size() && photo[at] == 0xff && photo[at + 1] >= 0xe0;) {
    const size_t length = size_t{photo[at + 2]} << 8 | photo[at + 3];
    if (length < 2 || at + 2 + length > photo.size()) return {};
    const auto payload = photo.begin() + static_cast<int64_t>(at) + 4;
    const auto end = photo.begin() + static_cast<int64_t>(at + 2 + length);
    if (photo[at + 1] == 0xe1 && length >= 2 + kStart.size() &&
        std::equal(kStart.begin(), kStart.end(), payload)) {
      return {payload, end};
    }
    at += 2 + length;
  }
  return {};
}

}  // namespace skein
