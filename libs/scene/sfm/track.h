#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <utility>
#include <vector>

#include "sfm/ids.h"

namespace skein {

// An observation of a point: a keypoint of an image.
struct TrackElement {
  TrackElement() = default;
  TrackElement(ImageId image, Point2DIdx index) : image_id(image), point2D_idx(index) {}

  ImageId image_id = kInvalidImageId;
  Point2DIdx point2D_idx = kInvalidPoint2DIdx;
};

// The observations of one point.
class Track {
 public:
  size_t Length() const { return elements_.size(); }

  const std::vector<TrackElement>& Elements() const { return elements_; }
  std::vector<TrackElement>& Elements() { return elements_; }
  bool HasImage(ImageId image_id) const;
  // Throws std::out_of_range.
  const TrackElement& Element(size_t i) const { return elements_.at(i); }

  void AddElement(const TrackElement& element) { elements_.push_back(element); }
  void AddElement(ImageId image_id, Point2DIdx index) { elements_.emplace_back(image_id, index); }
  void AddElements(const std::vector<TrackElement>& elements) {
    elements_.insert(elements_.end(), elements.begin(), elements.end());
  }
  // No effect if the track does not have it.
  void DeleteElement(ImageId image_id, Point2DIdx index);
  void Reserve(size_t num_elements) { elements_.reserve(num_elements); }

 private:
  std::vector<TrackElement> elements_;
};

// A triangulated point, in the world's frame.
class Point3D {
 public:
  const Eigen::Vector3d& XYZ() const { return xyz_; }
  Eigen::Vector3d& XYZ() { return xyz_; }
  double XYZ(size_t axis) const { return xyz_[static_cast<Eigen::Index>(axis)]; }
  double X() const { return xyz_.x(); }
  double Y() const { return xyz_.y(); }
  double Z() const { return xyz_.z(); }
  void SetXYZ(const Eigen::Vector3d& xyz) { xyz_ = xyz; }

  const Rgb& Color() const { return color_; }
  uint8_t Color(size_t channel) const { return color_[static_cast<Eigen::Index>(channel)]; }
  void SetColor(const Rgb& color) { color_ = color; }

  // Mean reprojection error in pixels; -1 until it is set.
  double Error() const { return error_; }
  bool HasError() const { return error_ != -1.0; }
  void SetError(double error_px) { error_ = error_px; }

  const class Track& Track() const { return track_; }
  class Track& Track() {
    return track_;
  }
  void SetTrack(class Track track) { track_ = std::move(track); }

 private:
  Eigen::Vector3d xyz_ = Eigen::Vector3d::Zero();
  Rgb color_ = Rgb::Zero();
  double error_ = -1.0;
  class Track track_;
};

}  // namespace skein
