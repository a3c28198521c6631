// Cause why a photo is in no map, and advice for the photographer.
//
// Two sets of sentences say the same. `what` and `remedy` (diagnosis.cc) go to skein agent,
// skein status, report.json and photo_diagnosis_t. The live view and the phone's page get CauseName
// and figures, and have sentences of their own (web/src/words.js, kCauses).
#pragma once

#include <cstdint>
#include <string>

#include "session/session_state.h"

namespace skein {

struct Diagnosis {
  // The numbers are photo_diagnosis_t's, where 14 is PLACED.
  enum class Cause {
    kWaiting = 0,         // no fault: the photo is in work, or waits for its turn
    kFailed = 1,          // a stage refused the photo or failed on it; `reason` is the stage's
    kTooDark = 2,         // mean grey level < kDark; also a covered lens
    kTooBright = 3,       // mean grey level > kBright
    kBlurred = 4,         // out of focus, or moved while it was taken
    kBare = 5,            // few keypoints, or on a small part of the photo
    kNoOverlap = 6,       // the photo has no verified pair
    kWeakOverlap = 7,     // too few common points with the map
    kRotationOnly = 8,    // the photo and all that overlap it were taken from one spot
    kPlanarOnly = 9,      // the photo and all that overlap it show one plane
    kSimilarPlace = 10,   // the photo may show another, visually similar place
    kContradicted = 11,   // its matches lead to different poses
    kCamera = 12,         // no possible focal length or distortion fits
    kNotInTime = 13,      // the finish was cut before its turn
    kNoInitialPair = 15,  // no map could begin with its strong pairs
  };
  Cause cause = Cause::kWaiting;
  std::string what;           // with numbers: "12 of 30 inliers with alice/0031.jpg"
  std::string remedy;         // advice for the photographer; "" if waiting helps
  std::string reason;         // of the stage or submap that refused the photo; "": none did
  int32_t num_inliers = 0;    // of its best verified pair, or with the map; 0: none
  int64_t best_other_id = 0;  // the photo of that pair; 0: none

  // "what; remedy"
  std::string Text() const;
};

const char* CauseName(Diagnosis::Cause cause);  // "weak overlap"

// CauseName of what a submap said of a photo, by registration_t's cause; "other" for OTHER.
const char* TrialCauseName(int8_t registration_cause);

// Cause and remedy for a photo that is registered in no submap. If several causes hold, the first
// in the order light, blur, texture, overlap, geometry, map is returned; a photo with a pair of
// limits::kMinSeedInliers is bright, sharp and textured enough. A pure function of the facts.
// Limits of geometry are those of core/limits.h; limits of light, blur and texture are constants of
// diagnosis.cc (kDark, kBright, kBlurred, kBareCoverage, kBareKeypoints).
Diagnosis Diagnose(const SessionState& state, const PhotoState& photo);

}  // namespace skein
