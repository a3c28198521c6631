#include "session/model_verdict.h"

#include <fmt/core.h>

namespace skein {
namespace {

using nlohmann::json;

bool IsKnown(const SubmapLife& submap) {
  return submap.latest_model && submap.latest_model->check.position_sigma > 0;
}

std::string Shape(const SessionState& state, const model_check_t& check) {
  if (!(check.position_sigma > kMaxPositionSigma)) return "";
  if (check.position_sigma >= 1 && check.loose_image != 0) {
    return fmt::format(
        "a part may stand in a wrong place: {} photos share hardly any points with the rest, on "
        "which they hang by {} - {}",
        check.num_loose_images, state.NameOf(check.loose_image), state.NameOf(check.anchor_image));
  }
  std::string text = fmt::format("may be bent: expected position error {:.1f} % of the extent",
                                 100 * check.position_sigma);
  if (check.loose_image == 0) return text;
  return text + fmt::format(", {} photos hang on the rest by {} - {}", check.num_loose_images,
                            state.NameOf(check.loose_image), state.NameOf(check.anchor_image));
}

std::string Matches(const SessionState& state, const model_check_t& check) {
  if (check.num_contradicting_matches <= kMaxContradictingShare * check.num_matches) return "";
  return fmt::format(
      "contradicted: {:.0f} % of the verified matches disagree with the poses, most of all {} of "
      "{} - {}",
      100.0 * check.num_contradicting_matches / check.num_matches, check.num_contradicting_of_pair,
      state.NameOf(check.contradicting_image1), state.NameOf(check.contradicting_image2));
}

}  // namespace

std::string VerdictOf(const SessionState& state, const SubmapLife& submap) {
  if (!IsKnown(submap)) return "";
  const std::string shape = Shape(state, submap.latest_model->check);
  const std::string matches = Matches(state, submap.latest_model->check);
  return shape + (shape.empty() || matches.empty() ? "" : "; ") + matches;
}

json CheckPart(const SessionState& state, const SubmapLife& submap) {
  if (!IsKnown(submap)) return nullptr;
  const model_check_t& check = submap.latest_model->check;
  json part = {{"expected_position_error_percent", 100 * check.position_sigma},
               {"matches", check.num_matches},
               {"contradicting_matches", check.num_contradicting_matches},
               {"verdict", VerdictOf(state, submap)}};
  if (check.loose_image != 0) {
    part["weakest_link"] = {state.NameOf(check.loose_image), state.NameOf(check.anchor_image)};
    part["photos_beyond_it"] = check.num_loose_images;
  }
  if (check.num_contradicting_matches > 0) {
    part["most_contradicting_pair"] = {state.NameOf(check.contradicting_image1),
                                       state.NameOf(check.contradicting_image2)};
    part["its_contradicting_matches"] = check.num_contradicting_of_pair;
  }
  return part;
}

}  // namespace skein
