#include "retrieval/messages.h"

#include "ledger/fact_ids.h"

namespace skein {

candidates_t ToMessage(const Candidates& candidates, int64_t computed_at_seq) {
  candidates_t message{};
  message.header.fact_id = CandidatesFactId(candidates.image_id);
  message.header.computed_at_seq = computed_at_seq;
  message.image_id = candidates.image_id;
  message.num_candidates = static_cast<int32_t>(candidates.neighbours.size());
  for (const Neighbour& neighbour : candidates.neighbours) {
    message.other_ids.push_back(neighbour.id);
    message.distances.push_back(neighbour.distance);
  }
  message.insert_s = candidates.insert_s;
  message.query_s = candidates.query_s;
  return message;
}

}  // namespace skein
