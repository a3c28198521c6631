// What the merger knows of the submaps: who is alive, how far each has worked, and which photos
// each holds. Filled from the ledger; only a submap's position comes from its status messages,
// which repeat, so a restart loses nothing.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace skein {

struct SubmapEntry {
  int64_t submap_id = 0;
  int64_t epoch = 0;      // of its latest lease; 0: no mapper has it yet
  std::string owner;      // instance of that lease
  int64_t image_id1 = 0;  // its seed
  int64_t image_id2 = 0;
  bool live = true;  // false: ended, merged or dissolved
  int64_t merged_into = 0;
  int64_t ledger_seq = 0;  // worked in up to here, by its latest epoch
  std::set<int64_t> registered;
  std::set<int64_t> deferred;
};

class SubmapDirectory {
 public:
  // A pair of live submaps, smaller id first, and the photos that both hold.
  using Pair = std::pair<int64_t, int64_t>;

  void OnSeed(int64_t submap_id, int64_t image_id1, int64_t image_id2);
  void OnLeased(int64_t submap_id, int64_t epoch, const std::string& owner);
  void OnEnded(int64_t submap_id);
  // The target holds what the source held.
  void OnMerged(int64_t source_id, int64_t target_id);
  // Registrations of an older epoch are history, too: ingest committed them when it was valid.
  void OnRegistered(int64_t submap_id, int64_t image_id);
  void OnNotRegistered(int64_t submap_id, int64_t image_id, bool deferred);
  // A status of an older epoch, or of an unknown submap, is dropped. A new epoch starts where its
  // checkpoint was: its position may be lower than the one before.
  void OnStatus(int64_t submap_id, int64_t epoch, int64_t ledger_seq);

  const SubmapEntry* Find(int64_t submap_id) const;  // null if unknown
  std::vector<const SubmapEntry*> Live() const;      // by id
  bool IsRegistered(int64_t image_id) const;         // in a live submap
  bool IsDeferred(int64_t image_id) const;           // by a live submap
  // Whether a submap, living or not, was started from this pair.
  bool WasSeeded(int64_t image_id1, int64_t image_id2) const;
  // Pairs that share at least one photo.
  std::map<Pair, std::vector<int64_t>> SharedPhotos() const;

 private:
  SubmapEntry& Entry(int64_t submap_id);

  std::map<int64_t, SubmapEntry> submaps_;
  std::map<int64_t, std::set<int64_t>> submaps_of_;  // image -> live submaps that hold it
  std::set<std::pair<int64_t, int64_t>> seeds_;      // images, smaller id first
};

}  // namespace skein
