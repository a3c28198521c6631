// Tells everyone why photos are in no map, as photo_diagnosis_t: at once when it changes, then
// every 10 s, since datagrams are lost.
#pragma once

#include <functional>
#include <map>
#include <string>

#include "session/session_state.h"
#include "skein/photo_diagnosis_t.hpp"

namespace skein {

class DiagnosisTeller {
 public:
  using Publish = std::function<void(const photo_diagnosis_t&)>;

  // `state` must outlive this.
  DiagnosisTeller(const SessionState& state, std::string session_id, Publish publish);

  // Looks at all photos, at most once a second: about 1 us a photo, and 5 us one that is in no map.
  void Tick(double now_s);

 private:
  struct Told {
    std::string text;
    double again_s = 0;
    int times_placed = 0;
  };

  void Tell(const PhotoState& photo, double now_s);
  void TellPlaced(const PhotoState& photo, Told* told, double now_s);

  const SessionState& state_;
  const std::string session_id_;
  const Publish publish_;
  std::map<int64_t, Told> told_;  // photos in no map, and for a while those that got into one
  double next_look_s_ = 0;
  int num_left_ = 0;  // messages of this look
};

}  // namespace skein
