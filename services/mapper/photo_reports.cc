#include "mapper/photo_reports.h"

#include <algorithm>
#include <utility>

#include "ledger/fact_ids.h"
#include "mapper/messages.h"

namespace skein {

PhotoReports::PhotoReports(const SessionState& session, const Lease& lease, Submit submit,
                           std::function<void()> on_refused)
    : session_(session),
      lease_(lease),
      submit_(std::move(submit)),
      on_refused_(std::move(on_refused)) {}

void PhotoReports::Tell(const std::vector<PhotoEvent>& events) {
  for (const PhotoEvent& event : events) {
    const int64_t id = event.image_id;
    const bool registered = event.state == PhotoEvent::State::kRegistered;
    if (registered) {
      registered_.insert(id);
    } else {
      registered_.erase(id);
    }
    registration_t fact = ToMessage(event, lease_.submap_id, lease_.epoch);
    fact.header.fact_id =
        RegistrationFactId(id, lease_.submap_id, lease_.epoch, first_number_ + ++num_facts_[id]);
    std::deque<registration_t>& undecided = undecided_[id];
    undecided.push_back(std::move(fact));
    if (undecided.size() == 1) SubmitNext(id);
  }
}

void PhotoReports::SubmitNext(int64_t image_id) {
  const registration_t& fact = undecided_[image_id].front();
  const bool registered = fact.state == registration_t::REGISTERED;
  submit_(
      fact, [this, image_id](int64_t) { OnDecided(image_id); },
      [this, image_id, registered](const std::string& reason) {
        OnDecided(image_id);
        if (!registered) return;
        refused_[image_id] = "refused by the ledger: " + reason;
        on_refused_();
      });
}

void PhotoReports::OnDecided(int64_t image_id) {
  const auto undecided = undecided_.find(image_id);
  undecided->second.pop_front();
  if (undecided->second.empty()) {
    undecided_.erase(undecided);
  } else {
    SubmitNext(image_id);
  }
}

std::vector<PhotoEvent> PhotoReports::NoteRestored(const std::vector<PhotoEvent>& events) {
  const std::vector<int64_t> known = session_.RegisteredIn(lease_.submap_id);
  std::vector<PhotoEvent> unknown;
  for (const PhotoEvent& event : events) {
    registered_.insert(event.image_id);
    if (!std::binary_search(known.begin(), known.end(), event.image_id)) unknown.push_back(event);
  }
  return unknown;
}

std::map<int64_t, std::string> PhotoReports::TakeRefused() { return std::exchange(refused_, {}); }

std::vector<PhotoEvent> PhotoReports::FindLost(const ItemCursor& cursor) {
  if (replay_seq_ == 0 || !cursor.HasReached(replay_seq_)) return {};
  replay_seq_ = 0;
  std::vector<PhotoEvent> lost;
  for (const int64_t id : session_.RegisteredIn(lease_.submap_id)) {
    if (IsRegistered(id)) continue;
    PhotoEvent event;
    event.image_id = id;
    event.state = PhotoEvent::State::kWithdrawn;
    event.refusal.text = "not registered again after the map changed hands";
    lost.push_back(event);
  }
  return lost;
}

}  // namespace skein
