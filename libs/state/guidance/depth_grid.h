#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "guidance/guided_map.h"

namespace skein {

struct Surfel;
class SurfelBlocks;

// As DepthGrid::Draw takes them.
Eigen::Matrix3Xf PositionsOf(const std::vector<Surfel>& surfels);

// The nearest surfel in each small square of a photo: what is behind it is hidden.
class DepthGrid {
 public:
  // Squares as wide as a surfel seen from `distance`.
  DepthGrid(const GuidedCamera& camera, const CameraPose& cam_from_world, double surfel_width,
            double distance);

  // A surfel within the frame.
  struct InFrame {
    uint32_t index;   // of its position
    uint32_t square;  // that it is in
    float depth;
  };
  using Positions = Eigen::Map<const Eigen::Matrix3Xf>;
  // Draws a surfel at each position that is finite. Returns those within the frame, hidden ones
  // too, ascending.
  std::vector<InFrame> Draw(const Positions& positions) {
    std::vector<InFrame> in_frame;
    Draw(positions, &in_frame);
    return in_frame;
  }
  std::vector<InFrame> Draw(const Eigen::Matrix3Xf& positions) {
    return Draw(Positions(positions.data(), 3, positions.cols()));
  }
  // The same of surfels by their index, in no order.
  std::vector<InFrame> Draw(const SurfelBlocks& surfels);
  // Whether a ball of surfels may have one that is drawn.
  bool MayMeet(const Eigen::Vector3d& middle, double radius) const;
  // Whether a surfel there is drawn, in part at least.
  bool Meets(const Eigen::Vector3f& position) const;
  bool HasDepthsOf(const DepthGrid& other) const { return depth_ == other.depth_; }

  enum class Sight { kOutside, kHidden, kSeen };
  // `tolerance`: a part of the depth, beside a surfel's width.
  Sight Look(const Eigen::Vector3d& xyz, double tolerance) const;
  bool IsSeen(const InFrame& surfel, double tolerance) const {
    return IsInFront(surfel.depth, surfel.square, tolerance);
  }

 private:
  bool IsInFront(double depth, size_t square, double tolerance) const {
    return depth <= depth_[square] * (1 + tolerance) + surfel_width_;
  }
  void Draw(const Positions& positions, std::vector<InFrame>* in_frame);
  void DrawDisc(float u, float v, float radius, float depth);

  GuidedCamera camera_;
  Eigen::Matrix3d rotation_;
  Eigen::Vector3d translation_;
  double surfel_width_;
  double square_px_;
  int columns_, rows_;
  std::array<Eigen::Vector3d, 4> sides_;  // normals of the frame's pyramid, outwards, unit
  std::vector<float> depth_;
};

}  // namespace skein
