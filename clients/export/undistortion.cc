#include "clients/export/undistortion.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <string>

#include "sfm/camera.h"

namespace skein {
namespace {

constexpr double kLargestScale = 2;

struct Borders {
  // How far from the principal point, in pixels of the focal length, the borders lie that are
  // nearest to it: left or right, top or bottom.
  Eigen::Array2d nearest;
  bool are_inverse = true;  // each pixel of them can be undistorted; else it sets no limit
};

Borders FindBorders(const Camera& camera) {
  const Eigen::Array2d size(static_cast<double>(camera.Width()),
                            static_cast<double>(camera.Height()));
  const Eigen::Array2d focal(camera.FocalLengthX(), camera.FocalLengthY());
  Borders borders{kLargestScale * size / 2};
  for (int axis = 0; axis < 2; ++axis) {
    const int along = 1 - axis;
    for (double at = 0; at <= size[along]; ++at) {
      for (const double side : {-1.0, 1.0}) {
        Eigen::Vector2d pixel;
        pixel[axis] = side < 0 ? 0 : size[axis];
        pixel[along] = at;
        const Eigen::Vector2d world = camera.ImageToWorld(pixel);
        const double px = side * world[axis] * focal[axis];
        if (px > 0 && (camera.WorldToImage(world) - pixel).norm() < 0.5) {
          borders.nearest[axis] = std::min(borders.nearest[axis], px);
        } else {
          borders.are_inverse = false;
        }
      }
    }
  }
  return borders;
}

}  // namespace

Undistortion::Undistortion(const Camera& camera) : distorted_(camera) {
  pinhole_.SetCameraId(camera.CameraId());
  pinhole_.SetModelId(kPinhole);
  pinhole_.SetFocalLengthX(camera.FocalLengthX());
  pinhole_.SetFocalLengthY(camera.FocalLengthY());
}

Result<Undistortion> Undistortion::Of(const Camera& camera) {
  Undistortion undistortion(camera);
  const Eigen::Array2d half = FindBorders(camera).nearest;
  undistortion.SetSize(
      {static_cast<int>(2 * half.x() + 1e-6), static_cast<int>(2 * half.y() + 1e-6)});
  undistortion.Map();
  if (Status status = undistortion.Crop(); !status.ok()) return status;
  return undistortion;
}

bool Undistortion::MayHaveBorders(const Camera& camera) { return !FindBorders(camera).are_inverse; }

void Undistortion::SetSize(cv::Size size) {
  pinhole_.SetWidth(static_cast<size_t>(std::max(1, size.width)));
  pinhole_.SetHeight(static_cast<size_t>(std::max(1, size.height)));
  pinhole_.SetPrincipalPointX(static_cast<double>(pinhole_.Width()) / 2);
  pinhole_.SetPrincipalPointY(static_cast<double>(pinhole_.Height()) / 2);
}

void Undistortion::Map() {
  const cv::Size size(static_cast<int>(pinhole_.Width()), static_cast<int>(pinhole_.Height()));
  map_x_.create(size);
  map_y_.create(size);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const Eigen::Vector2d pixel =
          distorted_.WorldToImage(pinhole_.ImageToWorld(Eigen::Vector2d(x + 0.5, y + 0.5)));
      map_x_(y, x) = static_cast<float>(pixel.x() - 0.5);
      map_y_(y, x) = static_cast<float>(pixel.y() - 0.5);
    }
  }
}

// Pixels that the photo shows: they map into it, up to rounding, and around them the map keeps its
// orientation.
// Beyond, a polynomial of the radius turns back and shows the photo's content a second time.
cv::Mat1b Undistortion::Valid() const {
  const auto width = static_cast<float>(distorted_.Width());
  const auto height = static_cast<float>(distorted_.Height());
  cv::Mat1b valid(map_x_.size(), uint8_t{0});
  for (int y = 0; y < valid.rows; ++y) {
    for (int x = 0; x < valid.cols; ++x) {
      const int x1 = std::min(x + 1, valid.cols - 1), x0 = x1 - 1;
      const int y1 = std::min(y + 1, valid.rows - 1), y0 = y1 - 1;
      const float px = map_x_(y, x), py = map_y_(y, x);
      const bool is_inside = px >= -1 && px <= width && py >= -1 && py <= height;
      if (!is_inside || x0 < 0 || y0 < 0) continue;
      const float dxx = map_x_(y, x1) - map_x_(y, x0), dxy = map_x_(y1, x) - map_x_(y0, x);
      const float dyx = map_y_(y, x1) - map_y_(y, x0), dyy = map_y_(y1, x) - map_y_(y0, x);
      valid(y, x) = dxx * dyy - dxy * dyx > 0 ? 255 : 0;
    }
  }
  return valid;
}

// To what is connected with the middle, and around it as far as that goes.
Status Undistortion::Crop() {
  cv::Mat1i parts;
  const cv::Mat1b valid = Valid();
  cv::connectedComponents(valid, parts, 4, CV_32S);
  const int middle = parts(parts.rows / 2, parts.cols / 2);
  if (middle == 0) {
    return InvalidArgument("camera " + std::to_string(distorted_.CameraId()) + " (" +
                           distorted_.ModelName() + ") has parameters that cannot be undistorted");
  }
  const cv::Mat1b seen = parts == middle;
  const cv::Rect box = cv::boundingRect(seen);
  const int left = std::min(box.x, seen.cols - box.x - box.width);
  const int top = std::min(box.y, seen.rows - box.y - box.height);
  const cv::Rect kept(left, top, seen.cols - 2 * left, seen.rows - 2 * top);
  map_x_ = map_x_(kept).clone();
  map_y_ = map_y_(kept).clone();
  mask_ = seen(kept).clone();
  has_borders_ = cv::countNonZero(mask_) < kept.area();
  SetSize(kept.size());
  return Status::Ok();
}

cv::Mat3b Undistortion::Apply(const cv::Mat3b& photo) const {
  if (static_cast<size_t>(photo.cols) != distorted_.Width() ||
      static_cast<size_t>(photo.rows) != distorted_.Height()) {
    throw std::invalid_argument("the photo has another size than its camera");
  }
  cv::Mat3b undistorted;
  cv::remap(photo, undistorted, map_x_, map_y_, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  if (has_borders_) undistorted.setTo(cv::Scalar::all(0), mask_ == 0);
  return undistorted;
}

Eigen::Vector2d Undistortion::Apply(const Eigen::Vector2d& point) const {
  return pinhole_.WorldToImage(distorted_.ImageToWorld(point));
}

}  // namespace skein
