#pragma once

// Between Skein's messages and the mapper's core.

#include <cstddef>

#include "core/result.h"
#include "mapper/model_assessment.h"
#include "mapping/submap.h"
#include "merging/submap_merge.h"
#include "skein/georeference_t.hpp"
#include "skein/image_t.hpp"
#include "skein/merge_t.hpp"
#include "skein/model_check_t.hpp"
#include "skein/registration_t.hpp"

namespace skein {

// A photo with its keypoints. The core validates it.
PhotoInput ToPhotoInput(const image_t& image, Keypoints keypoints);

// All but the header.
registration_t ToMessage(const PhotoEvent& event, int64_t submap_id, int64_t epoch);

// Sizes and errors of a submap_status_t or submap_model_t.
template <class T>
void SetFigures(const SubmapStatistics& statistics, T* message) {
  message->num_images = statistics.num_images;
  message->num_deferred = statistics.num_deferred;
  message->num_points = statistics.num_points;
  message->mean_reprojection_error_px = statistics.mean_reprojection_error_px;
  message->mean_track_length = statistics.mean_track_length;
}

// An order as merging takes it, but for what only the run knows: keeps_frames, was_done.
MergeOrder MergeOrderOf(const merge_t& ordered);

// Errors of the model that its residuals don't show.
model_check_t ToMessage(const ModelCheck& check);

// Outliers that a georeference_t tells: 16 KB of a message's 32.
constexpr size_t kMaxToldOutliers = 1000;

// The model's position on the earth. If there are more than kMaxToldOutliers outliers, the largest
// are told.
georeference_t GeoreferenceOf(const ModelAssessment& assessment);

}  // namespace skein
