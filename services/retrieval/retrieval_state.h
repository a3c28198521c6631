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
#include "retrieval/retrieval_options.h"

namespace skein {

// The photos most similar to `image_id` among those inserted before it.
struct Candidates {
  int64_t image_id = 0;
  std::vector<Neighbour> neighbours;  // best first
  float insert_s = 0;
  float query_s = 0;
};

// State of retrieval: a function of the ledger's facts up to `seq`, in their order. Each pair
// (model of global descriptor, dimension) has an index of its own, so photos of different models
// are never compared. Not thread-safe.
class RetrievalState {
 public:
  explicit RetrievalState(const RetrievalOptions& options) : options_(options) {}

  // Queries the index with the photo, then inserts the photo. Returns no candidates and inserts
  // nothing if the photo is in the index already or `descriptor` is empty. Error: a value is not
  // finite.
  Result<Candidates> Add(int64_t image_id, const GlobalDescriptor& descriptor);
  // A photo that was withdrawn from all its submaps is no candidate until it is registered again.
  void NoteRegistered(int64_t image_id, int64_t submap_id);
  void NoteWithdrawn(int64_t image_id, int64_t submap_id);

  // A parked photo is no candidate any more.
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
