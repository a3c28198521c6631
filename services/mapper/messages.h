#pragma once

// Between Skein's messages and the mapper's core.

#include <utility>
#include <vector>

#include "core/result.h"
#include "mapping/submap.h"
#include "skein/candidates_t.hpp"
#include "skein/image_t.hpp"
#include "skein/registration_t.hpp"
#include "skein/submap_t.hpp"

namespace skein {

// A photo with its keypoints. The core validates it.
PhotoInput ToPhotoInput(const image_t& image, Keypoints keypoints);

// Distances of global descriptors; entries with unusable ids or distances are left out.
std::vector<std::pair<uint32_t, double>> ToDistances(const candidates_t& candidates);

// All but the header.
registration_t ToMessage(const PhotoEvent& event, int64_t submap_id, int64_t epoch);

// Sizes and errors only.
submap_t ToMessage(const SubmapStatistics& statistics);

// "registration/IMAGE/SUBMAP/EPOCH/N", N counting the photo's facts of this epoch.
std::string RegistrationFactId(int64_t image_id, int64_t submap_id, int64_t epoch, int n);

}  // namespace skein
