#include "disambiguation/photo_groups.h"

#include <algorithm>
#include <set>
#include <utility>

namespace skein {

PhotoGroups::PhotoGroups(const std::vector<ImageId>& photos, const std::vector<PhotoEdge>& edges) {
  for (const ImageId id : photos) {
    group_of_[id] = id;
    groups_[id].members = {id};
  }
  for (const PhotoEdge& edge : edges) {
    groups_.at(edge.a).votes[edge.b].Add(edge.votes);
    groups_.at(edge.b).votes[edge.a].Add(edge.votes);
  }
}

void PhotoGroups::JoinUnlessContradicted(ImageId a, ImageId b) {
  a = group_of_.at(a);
  b = group_of_.at(b);
  if (a == b) return;
  const auto between = groups_[a].votes.find(b);
  if (between != groups_[a].votes.end() && between->second.contradict > between->second.agree) {
    return;
  }
  if (groups_[a].members.size() < groups_[b].members.size()) std::swap(a, b);
  Group& group = groups_[a];
  const Group joined = std::move(groups_[b]);
  groups_.erase(b);
  for (const ImageId member : joined.members) {
    group_of_[member] = a;
    group.members.push_back(member);
  }
  for (const auto& [other, votes] : joined.votes) {
    groups_.at(other).votes.erase(b);
    if (other == a) continue;
    group.votes[other].Add(votes);
    groups_.at(other).votes[a].Add(votes);
  }
}

void PhotoGroups::JoinByVotes(std::vector<PhotoEdge> edges) {
  std::stable_sort(edges.begin(), edges.end(), [](const PhotoEdge& a, const PhotoEdge& b) {
    return a.votes.agree - a.votes.contradict > b.votes.agree - b.votes.contradict;
  });
  for (const PhotoEdge& edge : edges) {
    if (edge.votes.agree > 0) JoinUnlessContradicted(edge.a, edge.b);
  }
}

std::vector<ImageId> PhotoGroups::LargestFirst() const {
  std::vector<ImageId> groups;
  for (const auto& [id, unused] : groups_) groups.push_back(id);
  std::stable_sort(groups.begin(), groups.end(), [this](ImageId a, ImageId b) {
    return groups_.at(a).members.size() > groups_.at(b).members.size();
  });
  return groups;
}

std::vector<ImageId> PhotoGroups::Contradicted(int min_contradiction, ImageId first) const {
  std::vector<ImageId> order = LargestFirst();
  if (const auto group = group_of_.find(first); group != group_of_.end()) {
    const auto before = std::find(order.begin(), order.end(), group->second);
    std::rotate(order.begin(), before, before + 1);
  }
  std::set<ImageId> stays;
  std::vector<ImageId> contradicted;
  for (const ImageId id : order) {
    const Group& group = groups_.at(id);
    int excess = 0;
    for (const auto& [other, votes] : group.votes) {
      if (stays.count(other) > 0) excess = std::max(excess, votes.contradict - votes.agree);
    }
    if (excess < min_contradiction) {
      stays.insert(id);
    } else {
      contradicted.insert(contradicted.end(), group.members.begin(), group.members.end());
    }
  }
  std::sort(contradicted.begin(), contradicted.end());
  return contradicted;
}

}  // namespace skein
