#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "ledger/facts.h"
#include "session/session_state.h"

namespace skein {

// Photos with a verified neighbour in a run's submap. The submap tries a photo if it is the photo's
// home (session/photo_homes.h); other photos wait until the ledger makes it their home. Loop's
// thread only.
class OfferedPhotos {
 public:
  // `one_home` false: every submap tries every photo that it can, as in the paper.
  OfferedPhotos(const SessionState& session, int64_t submap_id, bool one_home)
      : session_(session), submap_id_(submap_id), one_home_(one_home) {}

  // The run begins.
  void Start() { NoteAllHeld(); }
  // Once the session has applied it.
  void OnFact(const Fact& fact);

  void Offer(int64_t image_id);

  // Photos to try, each once.
  bool HasOurs() const { return !ours_.empty(); }
  int num_ours() const { return static_cast<int>(ours_.size()); }
  std::vector<int64_t> TakeOurs();
  // Photos that another submap holds now (true) or holds no longer, since the last call.
  std::vector<std::pair<int64_t, bool>> TakeHeldChanges();

 private:
  void React(const registration_t& registration);
  void React(const submap_end_t& end);
  template <class T>
  void React(const T&) {}
  void NoteAllHeld();
  void NoteHeldBy(const SubmapLife& submap);
  void NoteHeld(int64_t image_id);
  void Review(int64_t image_id);
  bool IsOurs(int64_t image_id) const;

  const SessionState& session_;
  const int64_t submap_id_;
  const bool one_home_;
  std::map<int64_t, bool> offered_;  // true: it went into ours_
  std::set<int64_t> ours_;
  std::set<int64_t> held_elsewhere_;
  std::set<int64_t> held_changed_;
};

}  // namespace skein
