#include "mapper/photo_groups.h"

#include <algorithm>
#include <numeric>

namespace skein {

PhotoGroups::PhotoGroups(size_t num_photos, const std::vector<PhotoEdge>& edges)
    : group_(num_photos), members_(num_photos), votes_(num_photos) {
  std::iota(group_.begin(), group_.end(), 0);
  for (size_t i = 0; i < num_photos; ++i) members_[i] = {static_cast<int>(i)};
  for (const PhotoEdge& edge : edges) {
    votes_[edge.a][edge.b].Add(edge.votes);
    votes_[edge.b][edge.a].Add(edge.votes);
  }
}

void PhotoGroups::JoinUnlessContradicted(int a, int b) {
  a = group_[a];
  b = group_[b];
  if (a == b) return;
  const auto between = votes_[a].find(b);
  if (between != votes_[a].end() && between->second.contradict > between->second.agree) return;
  if (members_[a].size() < members_[b].size()) std::swap(a, b);
  for (const int member : members_[b]) {
    group_[member] = a;
    members_[a].push_back(member);
  }
  members_[b].clear();
  for (const auto& [other, votes] : votes_[b]) {
    votes_[other].erase(b);
    if (other == a) continue;
    votes_[a][other].Add(votes);
    votes_[other][a].Add(votes);
  }
  votes_[b].clear();
}

void PhotoGroups::JoinByVotes(std::vector<PhotoEdge> edges) {
  std::stable_sort(edges.begin(), edges.end(), [](const PhotoEdge& a, const PhotoEdge& b) {
    return a.votes.agree - a.votes.contradict > b.votes.agree - b.votes.contradict;
  });
  for (const PhotoEdge& edge : edges) {
    if (edge.votes.agree > 0) JoinUnlessContradicted(edge.a, edge.b);
  }
}

std::vector<int> PhotoGroups::Contradicted(int min_contradiction, int first) const {
  std::vector<int> by_size;
  for (size_t i = 0; i < members_.size(); ++i) {
    if (!members_[i].empty()) by_size.push_back(static_cast<int>(i));
  }
  std::stable_sort(by_size.begin(), by_size.end(),
                   [this](int a, int b) { return members_[a].size() > members_[b].size(); });
  if (first >= 0) {
    const auto before = std::find(by_size.begin(), by_size.end(), group_[first]);
    std::rotate(by_size.begin(), before, before + 1);
  }
  std::vector<char> stays(members_.size(), false);
  std::vector<int> result;
  for (const int group : by_size) {
    int excess = 0;
    for (const auto& [other, votes] : votes_[group]) {
      if (stays[other]) excess = std::max(excess, votes.contradict - votes.agree);
    }
    stays[group] = excess < min_contradiction;
    if (stays[group]) continue;
    result.insert(result.end(), members_[group].begin(), members_[group].end());
  }
  return result;
}

}  // namespace skein
