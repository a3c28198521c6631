#pragma once

// Photos of a study, their local features, and the reference of retrieval: the pairs that overlap,
// by exhaustive matching and verification. A cache folder keeps both.

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "core/result.h"
#include "features/sift.h"
#include "matching/photo_features.h"

namespace skein::benchmark {

struct StudyPhoto {
  std::string path;
  int width_px = 0;
  int height_px = 0;
  double focal_px = 0;  // EXIF, else 1.2 * max(width, height)
  bool focal_from_exif = false;
  LocalFeatures features;
};

struct StudySet {
  std::string name;
  std::vector<StudyPhoto> photos;  // in name order: the order of arrival
};

// Called with (done, total) now and then.
using OnProgress = std::function<void(int64_t, int64_t)>;

// Photos under FOLDER, features computed or taken from `cache_folder`/NAME. `argument` is that of a
// command line: NAME=FOLDER.
Result<StudySet> LoadStudySet(const std::string& argument, const std::string& cache_folder,
                              const OnProgress& progress);

// As the matching service has them; for the cascade with cells.
PhotoFeaturesPtr ForMatching(const StudyPhoto& photo, int64_t id, const DescriptorCells* cells);

// inliers[i][j] for j < i: verified inliers of photos i and j, 0 if the pair was not verified.
using InlierCounts = std::vector<std::vector<int32_t>>;

// Exhaustive; goes on where an interrupted run stopped.
Result<InlierCounts> MatchExhaustively(const StudySet& set, const std::string& cache_folder,
                                       const OnProgress& progress);

}  // namespace skein::benchmark
