// How well a model's camera poses agree with a ground truth's.
#pragma once

#include <string>
#include <vector>

#include "core/result.h"
#include "geometry/model_poses.h"

namespace skein {

struct PosePair {
  std::string name;  // the ground truth's
  CameraPose estimate, truth;
};

// Pairs photos by full name, else by a file name without folders that is unique on both sides, else
// by the same without its ending. A truth of time stamps is paired by order with the estimate
// sorted by name, when both are equally many.
std::vector<PosePair> MatchPoses(const ModelPoses& estimate, const ModelPoses& truth);

struct ErrorSummary {
  double mean = 0, median = 0, rmse = 0, max = 0;
};

struct PoseEvaluation {
  size_t registered = 0;  // photos of the ground truth that have an estimate
  size_t total = 0;       // photos of the ground truth
  Similarity truth_from_estimate;
  bool aligned_by_orientation = false;  // the centres lie on a line: see AlignPoses
  double extent = 0;                    // largest distance between two centres of the ground truth
  ErrorSummary position;                // in the ground truth's unit
  ErrorSummary rotation_deg;
  double auc_1deg = 0, auc_3deg = 0, auc_5deg = 0;

  double PositionPercent(double length) const { return extent > 0 ? 100 * length / extent : 0; }
};

// Least-squares similarity over all pairs' centres (Umeyama 1991); no outlier is left out. Centres
// on one line leave the rotation about it open. Then the rotation is the chordal L2 mean of the
// orientations; scale and translation still come from the centres. An error for less than three
// pairs or centres that coincide.
Result<Similarity> AlignPoses(const std::vector<PosePair>& pairs, bool* by_orientation);

// AUC@t: area under the recall curve of relative poses up to t degrees, divided by t. Pairs are all
// pairs of the ground truth's photos. A pair's error is max(angle between the rotations, angle
// between the translation directions). A pair with a missing photo is a failure.
Result<PoseEvaluation> EvaluatePoses(const ModelPoses& estimate, const ModelPoses& truth);

}  // namespace skein
