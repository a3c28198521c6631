#pragma once

namespace skein {

// What is known of a photo before its pose is estimated.
struct TrialContext {
  bool may_look_alike = false;   // then it must not miss too much of the map either
  bool must_show_place = false;  // then there must be enough of the map in it to tell
  bool takes_ambiguous = false;  // a pose is taken although the photo's points agree on another
};

}  // namespace skein
