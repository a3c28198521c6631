#pragma once

#include <map>

namespace skein {

// Disjoint sets of ids (union-find by path halving; Tarjan and van Leeuwen 1984). An id that was
// not named before is a set of its own.
template <typename Id>
class DisjointSets {
 public:
  // The representative of the id's set.
  Id Find(Id id) {
    parent_.try_emplace(id, id);
    while (parent_[id] != id) id = parent_[id] = parent_[parent_[id]];
    return id;
  }
  // The second one's representative stays.
  void Join(Id id1, Id id2) { parent_[Find(id1)] = Find(id2); }

  // All ids that were named, each with its representative.
  std::map<Id, Id> Representatives() {
    std::map<Id, Id> found;
    for (const auto& [id, unused] : parent_) found[id] = id;
    for (auto& [id, representative] : found) representative = Find(id);
    return found;
  }

 private:
  std::map<Id, Id> parent_;
};

}  // namespace skein
