// Summary of a place as a whole: how complete the place is, in figures, in a word, in a sentence.
#pragma once

#include <cstdint>
#include <string>

#include "guidance/quality.h"

namespace skein {

// Numbers as guidance_t has them.
enum class PlaceVerdict : int8_t { kGrowing = 0, kWeak = 1, kNearly = 2, kComplete = 3 };

struct PlaceSummary {
  size_t num_photos = 0, num_surfels = 0;
  size_t num_open = 0;  // surfels that count, at a frontier
  Completeness completeness;
  PlaceVerdict verdict = PlaceVerdict::kGrowing;
  std::string sentence;  // for a person
};

PlaceSummary SummarisePlace(const PlaceQuality& place, size_t num_photos);

PlaceVerdict VerdictOfPlace(const Completeness& completeness, size_t num_photos,
                            size_t num_surfels);

// "82 % of the surface is good, 12 open borders: keep going"
std::string PlaceSentence(PlaceVerdict verdict, const Completeness& completeness, size_t num_photos,
                          size_t num_open);

}  // namespace skein
