// Why a pixel of the true surface has no agreed depth.
#pragma once

#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <vector>

#include "benchmark/depth/depth_truth.h"
#include "depth/model_depths.h"

namespace skein {

// Shares of the true surface's pixels by cause, the first that holds: agreed_right, agreed_wrong
// (by more than 2 %), not_seen_by_three (TruePlace), no_neighbour_sees_it (of the matched ones),
// not_confirmed (the sweep's depth is right), out_of_range, sweep_wrong, sweep_hole.
// "_one_neighbour": one matched neighbour alone sees it. Every second row and column counts.
nlohmann::json LossesOf(const DepthInput& input, const std::vector<DepthMap>& sweeps,
                        const std::vector<DepthMap>& agreed, const TruePlace& place,
                        const std::vector<cv::Mat1f>& truths);

}  // namespace skein
