// How complete the place of a submap is and where it lies, as its mapper told with its final model.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "session/session_state.h"

namespace skein {

// "completeness" and "georeference" of a submap in report.json: PlaceJson and GeoreferenceToJson.
// If the latest model does not tell them, both have the reason instead. Precondition: the submap
// has a model.
nlohmann::json CompletenessPart(const SubmapLife& submap);
nlohmann::json GeoreferencePart(const SessionState& state, const SubmapLife& submap);

// The sentence of the completeness, for a person, without control characters: a mapper chose it.
// "": not told.
std::string PlaceSentenceOf(const SubmapLife& submap);

}  // namespace skein
