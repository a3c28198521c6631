#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/bytes.h"
#include "core/result.h"

namespace skein {

struct HnswOptions {
  size_t M = 16;
  size_t ef_construction = 200;
  size_t ef_search = 200;
  size_t initial_capacity = 10'000;  // grows by doubling
  bool exact = false;                // search by scanning all vectors
};

struct Neighbour {
  int64_t id = 0;
  float distance = 0;  // Euclidean
};

// Vectors by id in a hierarchical navigable small world graph (Malkov and Yashunin 2018; hnswlib).
// One thread owns it: hnswlib must not insert while it searches. The graph depends on the order of
// insertion only, also across Encode and Decode.
class HnswIndex {
 public:
  HnswIndex(size_t dim, const HnswOptions& options);
  ~HnswIndex();
  HnswIndex(HnswIndex&&) noexcept;
  HnswIndex& operator=(HnswIndex&&) noexcept;

  // dim() values. Throws std::invalid_argument if the id is here already, removed or not.
  void Insert(int64_t id, const float* vector);
  // At most k, nearest first, equally near ones by id; removed ones are left out.
  std::vector<Neighbour> Query(const float* vector, size_t k) const;
  // The same by comparing with every vector, whatever the options.
  std::vector<Neighbour> QueryExact(const float* vector, size_t k) const;
  // Not found by queries any more, until Restore. No effect on ids that are not here.
  void Remove(int64_t id);
  void Restore(int64_t id);

  bool Contains(int64_t id) const;  // removed ones, too
  size_t size() const;              // with removed ones
  size_t capacity() const;
  size_t dim() const { return dim_; }
  // Of one vector with its links on the lowest level.
  size_t BytesPerVector() const;

  // hnswlib's own format. The caller guards it with a checksum: Decode trusts the bytes, and
  // notices only another dimension or a wrong size.
  Bytes Encode() const;
  static Result<HnswIndex> Decode(const Bytes& bytes, size_t dim, const HnswOptions& options);

 private:
  struct Graph;

  size_t dim_;
  HnswOptions options_;
  std::unique_ptr<Graph> graph_;
};

}  // namespace skein
