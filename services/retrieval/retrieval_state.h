#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/result.h"
#include "formats/formats.h"
#include "retrieval/hnsw_index.h"

namespace skein {

struct RetrievalOptions {
  size_t top_n = 200;        // of which matching takes the first 30 in any case (second_look.h)
  size_t num_expanding = 5;  // photos that a query is expanded by (hnsw_index.h); 0: none
  HnswOptions hnsw;

  Status Check() const;
};

// The photos most similar to `image_id` among those inserted before it.
struct Candidates {
  int64_t image_id = 0;
  std::vector<Neighbour> neighbours;  // best first
  float insert_s = 0;
  float query_s = 0;
};

// Everything retrieval knows: a function of the ledger up to `seq`, given its order. One index for
// each model of global descriptor and each dimension: a vector of a wrong one spoils no other
// photo's. One thread at a time.
class RetrievalState {
 public:
  explicit RetrievalState(const RetrievalOptions& options) : options_(options) {}

  // Query, then insert. A photo that was inserted before is not inserted again. A photo without a
  // descriptor is not inserted and has no candidates. Error: a value is not finite.
  Result<Candidates> Add(int64_t image_id, const GlobalDescriptor& descriptor);
  // A photo that was registered and is in no submap any more is no candidate until it registers
  // again.
  void NoteRegistered(int64_t image_id, int64_t submap_id);
  void NoteWithdrawn(int64_t image_id, int64_t submap_id);

  // A photo that was given up is offered to no one.
  void NoteFailed(int64_t image_id);

  size_t size() const;
  int64_t seq() const { return seq_; }
  void set_seq(int64_t seq) { seq_ = seq; }

  // Answers that may not be committed. The checkpoint holds them because their photos lie before
  // its ledger position.
  std::map<int64_t, Candidates>& unanswered() { return unanswered_; }

  // Checkpoint: 'SKHN', uint32 version, session, ledger position, contents, SHA-256 of all before.
  Bytes Encode(const std::string& session_id) const;
  // Error: no checkpoint, of another session or version, or damaged.
  static Result<RetrievalState> Decode(const Bytes& bytes, const std::string& session_id,
                                       const RetrievalOptions& options);

 private:
  struct Reader;

  RetrievalOptions options_;
  int64_t seq_ = 0;
  std::map<std::pair<std::string, size_t>, HnswIndex> indices_;  // by model and dimension
  std::map<int64_t, std::set<int64_t>> registered_in_;  // image -> submaps; empty: withdrawn
  std::map<int64_t, Candidates> unanswered_;
};

}  // namespace skein
