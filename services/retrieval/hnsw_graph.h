#pragma once

// hnswlib's graph with Skein's own search and insertion; file format and choice of links are
// hnswlib's. Differences:
//  - One search serves a photo's query and its insertion (paper, 3.2). hnswlib would search twice.
//  - All levels are searched with ef_construction, and all results enter the level below. hnswlib
//    and the paper (algorithm 1) follow one node above the photo's level. Photos of a place are
//    linked with each other and hardly with others. In a large index one node therefore ends beside
//    the place. Then the query misses it, and the photo is inserted without links to its place.
//  - The lowest level is entered at the latest photos, too: photos come along walks.
//  - All vectors of a node's links are fetched into the cache before the first is compared; vectors
//    lie on huge pages. A large index mostly waits for memory. hnswlib prefetches 64 bytes of one
//    vector.
//
// Include it in hnsw_index.cc only: hnswlib's headers define functions that are not inline.

#include <hnswlib/hnswlib.h>
#include <sys/mman.h>

#include <algorithm>
#include <cstdint>
#include <functional>
#include <queue>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "retrieval/int8_vector.h"

namespace skein {

class Int8Space : public hnswlib::SpaceInterface<float> {
 public:
  explicit Int8Space(size_t dim) : dim_(dim) {}
  size_t get_data_size() override { return Int8VectorSize(dim_); }
  hnswlib::DISTFUNC<float> get_dist_func() override { return Int8DistanceSq; }
  void* get_dist_func_param() override { return &dim_; }

 private:
  size_t dim_;
};

class HnswGraph : public hnswlib::HierarchicalNSW<float> {
 public:
  using Node = hnswlib::tableint;
  using Candidate = std::pair<float, Node>;  // squared distance, node

  HnswGraph(Int8Space* space, size_t capacity, size_t M, size_t ef_construction)
      : HierarchicalNSW(space, capacity, M, ef_construction) {
    UseHugePages();
  }

  // hnswlib counts the removed ones from a number it never set.
  HnswGraph(Int8Space* space, const std::string& path, size_t capacity)
      : HierarchicalNSW(space, path, false, capacity) {
    UseHugePages();
    num_deleted_ = 0;
    for (Node node = 0; node < cur_element_count; ++node) num_deleted_ += isMarkedDeleted(node);
  }

  void Grow(size_t capacity) {
    resizeIndex(capacity);
    UseHugePages();
  }

  float DistanceSq(const void* query, Node node) const {
    return fstdistfunc_(query, getDataByInternalId(node), dist_func_param_);
  }

  // The best of each level, the lowest first; each nearest first, without those removed.
  using Levels = std::vector<std::vector<Candidate>>;

  // `ef`: how many of the lowest level.
  Levels Search(const void* query, size_t ef) {
    if (cur_element_count == 0) return {};
    Levels found(maxlevel_ + 1);
    std::vector<Candidate> entries{{DistanceSq(query, enterpoint_node_), enterpoint_node_}};
    for (int level = maxlevel_; level >= 0; --level) {
      if (level == 0) AddLatest(query, &entries);
      found[level] = SearchLevel(query, entries, level == 0 ? ef : ef_construction_, level);
      if (!found[level].empty()) entries = found[level];
    }
    return found;
  }

  // `found`: what Search tells of this vector; no insertion since. `level` >= 0: the highest it is
  // on.
  void Insert(const void* vector, hnswlib::labeltype label, int level, const Levels& found) {
    const int top = maxlevel_;
    const Node node = AddRecord(vector, label, level);
    for (int l = std::min(level, top); l >= 0; --l) Connect(node, found[l], l);
    if (level <= top) return;
    enterpoint_node_ = node;
    maxlevel_ = level;
  }

 private:
  static constexpr Node kNumLatest = 32;  // a few of each of several agents

  using Queue = std::priority_queue<Candidate, std::vector<Candidate>, CompareByFirst>;
  using NearestFirst =
      std::priority_queue<Candidate, std::vector<Candidate>, std::greater<Candidate>>;

  void Prefetch(Node node) const {
    const char* vector = getDataByInternalId(node);
    for (size_t i = 0; i < data_size_; i += 64) __builtin_prefetch(vector + i);
  }

  std::pair<const Node*, size_t> LinksOf(Node node, int level) const {
    auto* list = get_linklist_at_level(node, level);
    return {list + 1, getListCount(list)};
  }

  void AddLatest(const void* query, std::vector<Candidate>* entries) const {
    const auto size = static_cast<Node>(cur_element_count);
    for (Node node = size - std::min(size, kNumLatest); node < size; ++node) {
      entries->emplace_back(DistanceSq(query, node), node);
    }
  }

  // Malkov and Yashunin 2018, algorithm 2. Removed nodes lead on, but are not among the result.
  std::vector<Candidate> SearchLevel(const void* query, const std::vector<Candidate>& entries,
                                     size_t ef, int level) {
    auto* visited = visited_list_pool_->getFreeVisitedList();
    const auto is_new = [visited](Node node) {
      return std::exchange(visited->mass[node], visited->curV) != visited->curV;
    };
    Queue best;
    NearestFirst open;
    const auto offer = [&](const Candidate& candidate) {
      if (best.size() == ef && candidate.first >= best.top().first) return;
      open.push(candidate);
      if (isMarkedDeleted(candidate.second)) return;
      best.push(candidate);
      if (best.size() > ef) best.pop();
    };
    for (const Candidate& entry : entries) {
      if (is_new(entry.second)) offer(entry);
    }
    std::vector<Node> fresh;
    while (!open.empty() && (best.size() < ef || open.top().first <= best.top().first)) {
      const auto [links, count] = LinksOf(open.top().second, level);
      open.pop();
      fresh.clear();
      for (size_t i = 0; i < count; ++i) {
        if (!is_new(links[i])) continue;
        Prefetch(links[i]);
        fresh.push_back(links[i]);
      }
      for (const Node node : fresh) offer({DistanceSq(query, node), node});
    }
    visited_list_pool_->releaseVisitedList(visited);
    std::vector<Candidate> nearest_first(best.size());
    for (size_t i = best.size(); i-- > 0; best.pop()) nearest_first[i] = best.top();
    return nearest_first;
  }

  // With some of the nearest ef_construction of the candidates.
  void Connect(Node node, const std::vector<Candidate>& candidates, int level) {
    const void* vector = getDataByInternalId(node);
    Queue queue;
    for (size_t i = 0; i < std::min(candidates.size(), ef_construction_); ++i) {
      queue.push(candidates[i]);
    }
    // All that were found are removed: none must be cut off from the others for that.
    if (queue.empty()) queue.emplace(DistanceSq(vector, enterpoint_node_), enterpoint_node_);
    mutuallyConnectNewElement(vector, node, queue, level, false);
  }

  Node AddRecord(const void* vector, hnswlib::labeltype label, int level) {
    const auto node = static_cast<Node>(cur_element_count);
    char* record = data_level0_memory_ + node * size_data_per_element_;
    std::fill(record, record + size_data_per_element_, '\0');
    setExternalLabel(node, label);
    std::copy_n(static_cast<const char*>(vector), data_size_, getDataByInternalId(node));
    element_levels_[node] = level;
    linkLists_[node] = nullptr;
    if (level > 0) {
      linkLists_[node] = static_cast<char*>(std::calloc(level, size_links_per_element_));
      if (!linkLists_[node]) throw std::runtime_error("not enough memory for the index");
    }
    label_lookup_[label] = node;
    ++cur_element_count;
    return node;
  }

  void UseHugePages() {
    constexpr size_t kHugePage = size_t{2} << 20;
    const auto start = reinterpret_cast<uintptr_t>(data_level0_memory_);
    const uintptr_t first = (start + kHugePage - 1) / kHugePage * kHugePage;
    const uintptr_t last = (start + max_elements_ * size_data_per_element_) / kHugePage * kHugePage;
    // Advice: where it is not taken, the index works as well, only slower.
    if (last > first) ::madvise(reinterpret_cast<void*>(first), last - first, MADV_HUGEPAGE);
  }
};

}  // namespace skein
