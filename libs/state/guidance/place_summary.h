// Summary of a place as a whole: how complete the place is, in figures, in a word, in a sentence.
#pragma once

#include <cstdint>
#include <string>

#include "core/finite.h"
#include "guidance/quality.h"

namespace skein {

// Numbers as completeness_t has them.
enum class PlaceVerdict : int8_t { kGrowing = 0, kWeak = 1, kNearly = 2, kComplete = 3 };

struct PlaceSummary {
  size_t num_photos = 0, num_surfels = 0;
  size_t num_open = 0;  // surfels that count, at a frontier
  Completeness completeness;
  PlaceVerdict verdict = PlaceVerdict::kGrowing;
  std::string sentence;  // for a person
};

PlaceSummary SummarisePlace(const PlaceQuality& place, size_t num_photos);

// Sets all fields of a message completeness_t. A figure that is not finite becomes 0.
// metres_per_unit: 0, not known.
template <class Message>
void SetCompleteness(const PlaceSummary& place, double metres_per_unit, Message* message) {
  const Completeness& completeness = place.completeness;
  message->num_photos = static_cast<int32_t>(place.num_photos);
  message->num_surfels = static_cast<int32_t>(place.num_surfels);
  message->num_open = static_cast<int32_t>(place.num_open);
  message->area = FiniteOrZero(completeness.area);
  message->good_share = static_cast<float>(FiniteOrZero(completeness.good_share));
  message->open_share = static_cast<float>(FiniteOrZero(completeness.open_share));
  message->median_sigma = FiniteOrZero(completeness.median_sigma);
  message->target_gsd = FiniteOrZero(completeness.target_gsd);
  message->metres_per_unit = FiniteOrZero(metres_per_unit);
  message->verdict = static_cast<int8_t>(place.verdict);
  message->sentence = place.sentence;
}

PlaceVerdict VerdictOfPlace(const Completeness& completeness, size_t num_photos,
                            size_t num_surfels);

// "82 % of the surface is good, 12 open borders: keep going"
std::string PlaceSentence(PlaceVerdict verdict, const Completeness& completeness, size_t num_photos,
                          size_t num_open);

}  // namespace skein
