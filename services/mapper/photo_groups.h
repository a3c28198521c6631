#pragma once

#include <cstddef>
#include <map>
#include <vector>

namespace skein {

// What speaks for and against two photos, or groups of photos, standing where they do.
struct Votes {
  int agree = 0;
  int contradict = 0;
  void Add(const Votes& other) {
    agree += other.agree;
    contradict += other.contradict;
  }
};

// Between photos a and b, as indices.
struct PhotoEdge {
  int a = 0, b = 0;
  Votes votes;
};

// Groups of photos, at first one each, with the votes between any two.
class PhotoGroups {
 public:
  // `edges`: each pair of photos at most once.
  PhotoGroups(std::size_t num_photos, const std::vector<PhotoEdge>& edges);

  // Makes one of the groups of both photos, unless more contradicts than agrees between them.
  void JoinUnlessContradicted(int a, int b);

  // Joins along all edges with an agreement, those with most of it left over first.
  void JoinByVotes(std::vector<PhotoEdge> edges);

  // Photos of groups that a group which stays contradicts by this many votes. Of two the larger one
  // stays, but the one with the photo `first` (-1: none) before all others.
  std::vector<int> Contradicted(int min_contradiction, int first = -1) const;

 private:
  std::vector<int> group_;  // of each photo
  std::vector<std::vector<int>> members_;
  std::vector<std::map<int, Votes>> votes_;
};

}  // namespace skein
