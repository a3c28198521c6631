#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "session/session_state.h"

namespace skein {

// Expected position error, as a fraction of the extent, above which a map is told to be possibly
// bent.
constexpr double kMaxPositionSigma = 0.01;
// Share of the verified matches that contradict the poses above which it is told. Right maps have
// up to 1 %. In a hall of equal tables right maps have 7 to 15 %, a wrong one has 11 %: matches do
// not tell them apart.
constexpr double kMaxContradictingShare = 0.05;

// Verdict on a submap's latest model beside its residuals (mapping/model_check.h), for a person:
// expected position error and weakest link if the error is above kMaxPositionSigma, and verified
// matches that contradict the poses if their share is above kMaxContradictingShare. If the error is
// 1 at a link, only the part beyond the link is told. "": nothing to tell.
std::string VerdictOf(const SessionState& state, const SubmapLife& submap);

// The same with all figures, for report.json. Null where they are not known.
nlohmann::json CheckPart(const SessionState& state, const SubmapLife& submap);

}  // namespace skein
