#pragma once

// hnswlib's graph with a search and an insertion of our own over its data; file format and choice
// of links are hnswlib's. What differs:
//  - a photo's search of the lowest level serves its query and its insertion: the paper finds the
//    candidates during the update of the graph (3.2), hnswlib would search twice;
//  - all vectors that a node's links lead to are fetched into the cache at once, before the first
//  is
//    compared, and the vectors lie on huge pages: in a large index waiting for memory is nearly all
//    of the time, and hnswlib asks for the first 64 bytes of one vector ahead.
//
// To be included in hnsw_index.cc only: hnswlib's headers define functions that aren't inline.

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

  // The best `ef` on the lowest level, nearest first, without those removed.
  std::vector<Candidate> Search(const void* query, size_t ef) {
    if (cur_element_count == 0) return {};
    return SearchLevel(query, Descend(query, 0), ef, 0);
  }

  // `found`: what Search tells of this vector; no insertion since. `level` >= 0: the highest it is
  // on.
  void Insert(const void* vector, hnswlib::labeltype label, int level,
              std::vector<Candidate> found) {
    const Node node = AddRecord(vector, label, level);
    if (node > 0) {
      const int top = std::min(level, maxlevel_);
      Node entry = top > 0 ? Descend(vector, top) : enterpoint_node_;
      for (int l = top; l > 0; --l) {
        entry = Connect(node, SearchLevel(vector, entry, ef_construction_, l), l);
      }
      if (found.size() > ef_construction_) found.resize(ef_construction_);
      Connect(node, found, 0);
    }
    if (node > 0 && level <= maxlevel_) return;
    enterpoint_node_ = node;
    maxlevel_ = level;
  }

 private:
  using Queue = std::priority_queue<Candidate, std::vector<Candidate>, CompareByFirst>;
  using NearestFirst =
      std::priority_queue<Candidate, std::vector<Candidate>, std::greater<Candidate>>;

  // Links and vector of a node lie one after the other.
  void Prefetch(Node node) const {
    const char* record = data_level0_memory_ + node * size_data_per_element_;
    for (size_t i = 0; i < size_data_per_element_; i += 64) __builtin_prefetch(record + i);
  }

  std::pair<const Node*, size_t> LinksOf(Node node, int level) const {
    auto* list = get_linklist_at_level(node, level);
    return {list + 1, getListCount(list)};
  }

  // From the top down to above `level`, always to the nearest neighbour.
  Node Descend(const void* query, int level) const {
    Node nearest = enterpoint_node_;
    float nearest_sq = DistanceSq(query, nearest);
    for (int l = maxlevel_; l > level; --l) {
      for (bool moved = true; moved;) {
        moved = false;
        const auto [links, count] = LinksOf(nearest, l);
        for (size_t i = 0; i < count; ++i) Prefetch(links[i]);
        for (size_t i = 0; i < count; ++i) {
          const float distance_sq = DistanceSq(query, links[i]);
          if (distance_sq >= nearest_sq) continue;
          nearest_sq = distance_sq;
          nearest = links[i];
          moved = true;
        }
      }
    }
    return nearest;
  }

  // Malkov and Yashunin 2018, algorithm 2. Removed nodes lead on, but are not among the result.
  std::vector<Candidate> SearchLevel(const void* query, Node entry, size_t ef, int level) {
    auto* visited = visited_list_pool_->getFreeVisitedList();
    Queue best;
    NearestFirst open;
    std::vector<Node> fresh{entry};
    visited->mass[entry] = visited->curV;
    while (true) {
      for (const Node node : fresh) {
        const float distance_sq = DistanceSq(query, node);
        if (best.size() == ef && distance_sq >= best.top().first) continue;
        open.emplace(distance_sq, node);
        if (isMarkedDeleted(node)) continue;
        best.emplace(distance_sq, node);
        if (best.size() > ef) best.pop();
      }
      if (open.empty() || (best.size() == ef && open.top().first > best.top().first)) break;
      const Node next = open.top().second;
      open.pop();
      fresh.clear();
      const auto [links, count] = LinksOf(next, level);
      for (size_t i = 0; i < count; ++i) {
        if (std::exchange(visited->mass[links[i]], visited->curV) == visited->curV) continue;
        Prefetch(links[i]);
        fresh.push_back(links[i]);
      }
    }
    visited_list_pool_->releaseVisitedList(visited);
    std::vector<Candidate> nearest_first(best.size());
    for (size_t i = best.size(); i-- > 0; best.pop()) nearest_first[i] = best.top();
    return nearest_first;
  }

  // Returns the neighbour from which to search the level below.
  Node Connect(Node node, const std::vector<Candidate>& candidates, int level) {
    const void* vector = getDataByInternalId(node);
    Queue queue;
    for (const Candidate& candidate : candidates) queue.push(candidate);
    // All that were found are removed: none must be cut off from the others for that.
    if (queue.empty()) queue.emplace(DistanceSq(vector, enterpoint_node_), enterpoint_node_);
    return mutuallyConnectNewElement(vector, node, queue, level, false);
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
