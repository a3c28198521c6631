// Why a submap does not hold a photo: a kind for programs, a text for people.
#pragma once

#include <string>

namespace skein {

struct Refusal {
  // The numbers are registration_t's.
  enum class Cause {
    kOther = 0,
    kTooFewCommonPoints = 1,  // with the map's, or too few that agree on a pose
    kSimilarPlace = 2,        // the photo may show another, visually similar place
    kContradicted = 3,        // its matches, or other photos', say that it is elsewhere
    kCamera = 4,              // no possible focal length or distortion fits
  };
  Cause cause = Cause::kOther;
  std::string text;
};

}  // namespace skein
