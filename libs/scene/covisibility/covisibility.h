#pragma once

// Graph of photos that are known to see the same scene: the verified pairs of the ledger's
// matches_t.

#include <cstdint>
#include <unordered_map>
#include <vector>

namespace skein {

class CovisibilityGraph {
 public:
  struct Edge {
    // Values of COLMAP's TwoViewGeometry::ConfigurationType.
    static constexpr int8_t kCalibrated = 2, kUncalibrated = 3, kPlanar = 4, kPanoramic = 5;

    int64_t other_id = 0;
    int32_t num_inliers = 0;
    int64_t seq = 0;           // ledger position of the first fact that tells of the pair
    float tri_angle_rad = 0;   // median triangulation angle
    float forward_motion = 0;  // |z| of the unit relative translation, 0..1
    int8_t geometry = 0;       // two_view_t's

    // The matches tell of no translation.
    bool IsRotation() const { return geometry == kPanoramic; }
    // Neither a plane nor a rotation explains the matches.
    bool IsEpipolar() const { return geometry == kCalibrated || geometry == kUncalibrated; }
  };

  // A pair that is known already stays as it is. Costs the smaller number of edges of the two.
  void Add(int64_t image_id, const Edge& edge);
  void Add(int64_t image_id, int64_t other_id, int32_t num_inliers, int64_t seq) {
    Add(image_id, {other_id, num_inliers, seq, 0, 0});
  }

  // In the order of Add, that is of seq; empty for an unknown photo.
  const std::vector<Edge>& EdgesOf(int64_t image_id) const;

  // Whether a photo and that of its edge were taken from one spot. A rotation explains the pair, or
  // the pairs of both photos with a third one, each of more inliers: an epipolar geometry explains
  // the noise of a weak pair, too. Costs the number of edges of the two.
  bool IsOfOneSpot(int64_t image_id, const Edge& edge) const;

 private:
  std::unordered_map<int64_t, std::vector<Edge>> edges_;
};

}  // namespace skein
