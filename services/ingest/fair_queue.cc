#include "ingest/fair_queue.h"

#include <algorithm>
#include <utility>

namespace skein {

void FairJobQueue::Add(const std::string& party, Job job) {
  Party& found = parties_[party];
  if (found.jobs.empty()) found.had_s = std::max(found.had_s, level_s_);
  found.jobs.push_back(std::move(job));
}

std::optional<FairJobQueue::Next> FairJobQueue::Take() {
  auto least = parties_.end();
  for (auto party = parties_.begin(); party != parties_.end();) {
    const Party& each = party->second;
    if (each.jobs.empty() && each.had_s <= level_s_) {  // as one that never came
      party = parties_.erase(party);
      continue;
    }
    const bool is_less = least == parties_.end() || each.had_s < least->second.had_s;
    if (!each.jobs.empty() && is_less) least = party;
    ++party;
  }
  if (least == parties_.end()) return std::nullopt;
  level_s_ = least->second.had_s;
  Next next{least->first, std::move(least->second.jobs.front())};
  least->second.jobs.pop_front();
  return next;
}

void FairJobQueue::NoteWork(const std::string& party, double seconds) {
  const auto found = parties_.find(party);
  if (found != parties_.end()) found->second.had_s += seconds;
}

}  // namespace skein
