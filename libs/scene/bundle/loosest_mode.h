#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "bundle/bundle.h"

namespace skein {

// The collective deformation of a map that its observations determine least. Residuals don't show
// it: along it they hardly change.
struct LoosestMode {
  // Standard deviation of the positions along it, RMS over the poses; unit of the world's frame.
  double sigma = 0;
  // Expected position error, RMS over the poses: of this and the next modes together. The residuals
  // of a photo are taken as one draw, as they share errors; at least that of independent noise.
  double expected_error = 0;
  // Standard deviation of an observation's coordinate: the a posteriori standard deviation of unit
  // weight, from the residuals and the redundancy.
  double noise_px = 0;
  // Displacement of each pose's centre at one sigma, world frame. Free of translation, rotation and
  // scale.
  std::vector<Eigen::Vector3d> displacements;
};

// `bundle`: a whole map at its minimum; the mode is found by linearisation there. The points are
// eliminated, the refined intrinsics are unknowns with their priors. C is the covariance of the
// centres once the best similarity is taken out (the S-transformation of Baarda, as in Triggs et
// al., Bundle Adjustment - A Modern Synthesis, section 9). The mode is C's largest eigenvector, by
// 20 Lanczos iterations with one Cholesky decomposition of the reduced system. The expected error
// sums variances along the eigenvectors v that these find. Independent noise has v' C v. Errors
// that a photo's observations share have (sum of r' d)^2, summed over the photos, where r are the
// photo's residuals, which change by d along v. The estimator is the sandwich of White (1980), with
// a cluster for each photo (Liang and Zeger 1986). The larger sum counts. The bundle was minimised
// with the loss of BundleOptions.
// The result does not depend on the number of threads. Nothing if the observations leave a pose
// undetermined. Throws std::invalid_argument if a pose is constant.
std::optional<LoosestMode> FindLoosestMode(const Bundle& bundle, int num_threads = 1);

// Maximum spanning tree of poses, which are joined by the points that they share. Each edge cuts
// them into two parts.
struct SpanningTree {
  std::vector<int> order;   // a pose comes after its parent
  std::vector<int> parent;  // -1: the root, the parent of poses that share points with none
  std::vector<int> shared;  // points shared with the parent that may tie (ThinnestCut)
};
// By Prim's algorithm.
SpanningTree MaximumSpanningTree(const Bundle& bundle);

// Cut of a map at which a deformation bends. FindWeakestCut returns the cut of the bundle's tree
// with the largest explained_share, by two similarities, one for each part.
struct WeakestCut {
  int loose = -1;              // pose at the cut, on the side with fewer poses; -1: there is no cut
  int anchor = -1;             // pose at the cut, on the other side
  int num_loose = 0;           // poses on the loose side
  double explained_share = 0;  // of the squared displacements
};
WeakestCut FindWeakestCut(const Bundle& bundle, const SpanningTree& tree,
                          const std::vector<Eigen::Vector3d>& displacements);

// Cut of the bundle's tree at which fewest points tie the sides, each with a scale of its own: it
// sees `min_points` from two directions. A point ties if both sides observe it, from three
// directions: of other points no side tells the depth, and the scale between the sides stays free.
// Nothing if each such cut has `min_points` or more. A cut has at least as many as its edge: only
// edges with fewer cost a visit of all observations.
struct ThinnestCut {
  int loose = -1;  // as in WeakestCut
  int anchor = -1;
  std::vector<int> loose_side;  // its poses, ascending
  int num_points = 0;           // that tie the sides
};
std::optional<ThinnestCut> FindThinnestCut(const Bundle& bundle, const SpanningTree& tree,
                                           int min_points);

// Largest distance between two centres of the bundle's poses.
double ExtentOf(const Bundle& bundle);

}  // namespace skein
