#include "session/submap_facts.h"

#include "ledger/fact_ids.h"

namespace skein {

submap_end_t MakeSubmapEnd(int64_t submap_id, int64_t epoch, const std::string& reason,
                           int64_t merged_into) {
  submap_end_t end{};
  end.header.fact_id = SubmapEndFactId(submap_id);
  end.submap_id = submap_id;
  end.epoch = epoch;
  end.reason = ClampText(reason);
  end.merged_into = merged_into;
  return end;
}

submap_end_t MakeMergedEnd(const merge_t& done, const SessionState& state) {
  const SubmapLife* source = state.FindSubmap(done.source_id);
  return MakeSubmapEnd(done.source_id, source == nullptr ? 0 : source->lease.epoch,
                       MergedReason(done.target_id), done.target_id);
}

}  // namespace skein
