#pragma once

#include <map>
#include <vector>

#include "map/scene_map.h"

namespace skein {

// Observations that support (agree) or oppose (contradict) the poses of two photos, or groups of
// photos, relative to each other.
struct Votes {
  int agree = 0;
  int contradict = 0;
  int Sum() const { return agree + contradict; }
  // Share of `agree` in all; 1 if there are none.
  double AgreeingShare() const { return Sum() == 0 ? 1.0 : static_cast<double>(agree) / Sum(); }
  void Add(const Votes& other) {
    agree += other.agree;
    contradict += other.contradict;
  }
};

// Between photos a and b.
struct PhotoEdge {
  ImageId a = 0, b = 0;
  Votes votes;
};

// Groups of photos, at first one each, with the votes between any two.
class PhotoGroups {
 public:
  // `edges`: each pair of photos at most once; between these photos only.
  PhotoGroups(const std::vector<ImageId>& photos, const std::vector<PhotoEdge>& edges);

  // Joins groups along all edges with an agreement, the largest surplus first. Two groups with more
  // contradiction than agreement between them are never joined.
  void JoinByVotes(std::vector<PhotoEdge> edges);

  // Photos of groups that a remaining group contradicts by this many votes, ascending. Groups are
  // judged in the order of their size, the group with the photo `first` before all others: only
  // groups that remain can contradict later ones.
  std::vector<ImageId> Contradicted(int min_contradiction, ImageId first = kInvalidImageId) const;

 private:
  // A group goes by the id of one of its photos.
  struct Group {
    std::vector<ImageId> members;
    std::map<ImageId, Votes> votes;  // with other groups
  };

  void JoinUnlessContradicted(ImageId a, ImageId b);
  std::vector<ImageId> LargestFirst() const;

  std::map<ImageId, ImageId> group_of_;
  std::map<ImageId, Group> groups_;
};

}  // namespace skein
