// Failed photos: advised, taken, and not registered, as far as the ledger tells.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "guide/place_guidance.h"
#include "session/session_state.h"

namespace skein {

// No photo says which viewpoint it was taken for. An agent's first photo after its advice counts
// for the first viewpoint, the next photo for the second. An agent that takes photos elsewhere,
// which then do not register, therefore loses viewpoints, but only of its own advice.
class VainAdvice {
 public:
  // Notes the agent's present advice, which replaces the one before.
  void NoteAdvice(int64_t submap_id, const AgentAdvice& advice);
  void NotePhoto(const std::string& agent, int64_t image_id);
  // After a fact of the photo: the submap in which advice has to be chosen again, 0 if in none. A
  // photo failed if a submap tried it and does not hold it, or if it matches no other, unless it is
  // blurred, too dark or too bright: its viewpoint is advised again then.
  int64_t NoteOutcome(const SessionState& state, int64_t image_id);
  void Drop(int64_t submap_id);

  // Failed photos of the agent, in the submap's frame.
  std::vector<VainPhoto> Of(const std::string& agent, int64_t submap_id) const;

 private:
  struct Told {
    int64_t submap_id = 0;
    std::vector<VainPhoto> stations;
    size_t num_taken = 0;  // photos since
  };
  struct Taken {
    std::string agent;
    int64_t submap_id = 0;
    VainPhoto photo;
    bool in_vain = false;
  };

  std::map<std::string, Told> told_;  // by agent
  std::map<int64_t, Taken> taken_;    // by image_id; the newest
};

}  // namespace skein
