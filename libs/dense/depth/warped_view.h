// A neighbour as the reference sees it by one plane, from which all others follow by a shift and a
// scale.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "depth/depth_map.h"
#include "depth/sweep_kernels.h"

namespace skein {

// Positions of a reference row's columns in the warped neighbour, for one plane, as WarpTask has
// them. The first column is -kWarpBorder.
struct PlaneColumns {
  std::vector<int32_t> window;
  std::vector<uint8_t> pairs;
  std::vector<int8_t> weights;
};

constexpr int kWarpBorder = 2 * kSweepBlock;  // columns before a row's first

// WarpedView::SearchLengthPx of a neighbour that is not warped.
double SearchLengthPx(const DepthPhoto& reference, const DepthPhoto& neighbour,
                      const SweepPlanes& planes);

class WarpedView {
 public:
  WarpedView(const DepthPhoto& reference, const DepthPhoto& neighbour, const SweepPlanes& planes);

  // Pixels between where a pixel of the reference lies at the nearest and at the farthest plane,
  // the most over the photo.
  double SearchLengthPx() const;

  // Pixels by which a pixel of the reference moves for each unit of inverse depth, at a plane.
  double Parallax(const Eigen::Vector2d& ray, double plane) const;
  double SquaredParallax(const Eigen::Vector2d& ray, double plane) const;

  // Makes this plane (SweepPlanes) the one that all below is of.
  void SetPlane(double plane);

  // Whether the neighbour can be seen in row y of the reference.
  bool ShowsRow(int y) const;

  // Fills in what is of the neighbour, for row y of the reference, at any y.
  void FillRow(int y, WarpTask* task) const;
  // Columns [first, last) of the reference whose census windows lie in the neighbour.
  void Range(int y, int* first, int* last) const;

  int source_width() const { return width_; }

 private:
  struct Interval {
    int first, last;  // [first, last)
  };
  void SetSize();
  void Render(const DepthPhoto& neighbour);
  void FindIntervals(const cv::Mat1b& seen);
  WarpedView(const DepthCamera& reference, const SweepPlanes& planes)
      : camera_(reference), planes_(planes) {}
  // By the homography of the middle plane. False: that plane shows nothing.
  bool SetMotion(const DepthPose& reference, const DepthPhoto& neighbour);
  friend double SearchLengthPx(const DepthPhoto& reference, const DepthPhoto& neighbour,
                               const SweepPlanes& planes);
  double Row(int y) const { return scale_ * y + shift_.y(); }
  Interval IntervalAt(int y) const;

  DepthCamera camera_;  // of the reference
  SweepPlanes planes_;
  // Pixels, the centre of the first one at 0, 0.
  Eigen::Matrix3d neighbour_from_reference_ = Eigen::Matrix3d::Identity();
  Eigen::Vector3d motion_ = Eigen::Vector3d::Zero();  // of a ray by inverse depth
  bool is_usable_ = false;

  int left_ = 0, top_ = 0;  // of the reference in the canvas
  int width_ = 0, height_ = 0, stride_ = 0;
  std::vector<uint8_t> canvas_;
  std::vector<Interval> intervals_;  // of each row: where the neighbour shows something

  bool is_seen_ = false;
  double scale_ = 1;  // column x of the reference is scale_ * x + shift_.x() of the canvas
  Eigen::Vector2d shift_ = Eigen::Vector2d::Zero();
  PlaneColumns columns_;
};

}  // namespace skein
