#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "ledger/facts.h"

namespace skein {

// What a mapper needs to know of the ledger, by id. Grows with the ledger's facts, a few hundred
// bytes a photo. Loop's thread only.
class LedgerIndex {
 public:
  void Take(const Fact& fact);

  const image_t* FindImage(int64_t image_id) const;
  const features_t* FindFeatures(int64_t image_id) const;
  const candidates_t* FindCandidates(int64_t image_id) const;
  const matches_t* FindMatches(int64_t image_id) const;
  const seed_t* FindSeed(int64_t submap_id) const;
  // The newest fact of the submap with a model; null if it has none.
  const submap_t* FindModel(int64_t submap_id) const;
  // ASSIGNED of the highest epoch; null before the first.
  const submap_t* FindLease(int64_t submap_id) const;
  bool HasEnded(int64_t submap_id) const { return ended_.count(submap_id) > 0; }
  // The facts of a merge, newest last.
  const std::vector<merge_t>& FindMerge(int64_t merge_id) const;

  // Photos with a verified pair with this one, with the seq at which it became known.
  const std::map<int64_t, int64_t>& Neighbours(int64_t image_id) const;
  // Photos that the ledger holds for registered in the submap.
  std::vector<int64_t> RegisteredIn(int64_t submap_id) const;
  // Facts of this registration that the epoch has committed.
  int CountRegistrations(int64_t image_id, int64_t submap_id, int64_t epoch) const;

 private:
  void TakeMatches(const matches_t& matches);
  void TakeSubmap(const submap_t& submap);
  void TakeMerge(const merge_t& merge);
  void TakeRegistration(const registration_t& registration);

  std::map<int64_t, image_t> images_;
  std::map<int64_t, features_t> features_;
  std::map<int64_t, candidates_t> candidates_;
  std::map<int64_t, matches_t> matches_;
  std::map<int64_t, seed_t> seeds_;
  std::map<int64_t, submap_t> models_;
  std::map<int64_t, submap_t> leases_;
  std::map<int64_t, bool> ended_;
  std::map<int64_t, std::vector<merge_t>> merges_;
  std::map<int64_t, std::map<int64_t, int64_t>> neighbours_;
  std::map<int64_t, std::map<int64_t, bool>> registered_;  // submap, image
  std::map<std::string, int> num_registrations_;
};

}  // namespace skein
