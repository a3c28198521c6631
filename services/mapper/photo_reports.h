#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "mapper/item_log.h"
#include "mapper/lease.h"
#include "mapper/submissions.h"
#include "mapping/photo_event.h"
#include "session/session_state.h"

namespace skein {

// Submits each change of a photo's state to the ledger as a fact. The next fact of a photo waits
// until ingest has decided on the one before: otherwise a lost fact, submitted again, would be
// taken for the newer one. Loop's thread only.
class PhotoReports {
 public:
  using Submit = std::function<void(Fact, Submissions::OnCommitted, Submissions::OnRefused)>;

  // on_refused: there is a photo to take back.
  PhotoReports(const SessionState& session, const Lease& lease, Submit submit,
               std::function<void()> on_refused);

  // The run begins where the ledger is at `seq`. A photo's facts are numbered from there: an
  // earlier process may have told some in the same epoch.
  void NumberFrom(int64_t seq) { first_number_ = seq; }
  void Tell(const std::vector<PhotoEvent>& events);
  // Photos that a model brought. Returns those that the ledger does not know of.
  std::vector<PhotoEvent> NoteRestored(const std::vector<PhotoEvent>& events);

  bool IsRegistered(int64_t image_id) const { return registered_.count(image_id) > 0; }
  int num_registered() const { return static_cast<int>(registered_.size()); }

  // Registrations that ingest refused, with the reason. These photos must not stay in the map:
  // nobody would know of them. If ingest refuses another fact of a photo, the ledger still holds
  // the state before.
  bool HasRefused() const { return !refused_.empty(); }
  std::map<int64_t, std::string> TakeRefused();

  // An earlier epoch has worked up to `seq` at most. Once the cursor has reached it, FindLost gives
  // the photos that the ledger holds for registered and that are not.
  void ExpectReplayUpTo(int64_t seq) { replay_seq_ = seq; }
  std::vector<PhotoEvent> FindLost(const ItemCursor& cursor);

 private:
  void SubmitNext(int64_t image_id);
  void OnDecided(int64_t image_id);

  const SessionState& session_;
  const Lease lease_;
  const Submit submit_;
  const std::function<void()> on_refused_;
  std::set<int64_t> registered_;
  int64_t first_number_ = 0;
  std::map<int64_t, int64_t> num_facts_;                     // of a photo
  std::map<int64_t, std::deque<registration_t>> undecided_;  // of a photo; the first is submitted
  std::map<int64_t, std::string> refused_;
  int64_t replay_seq_ = 0;  // 0: what was lost is known
};

}  // namespace skein
