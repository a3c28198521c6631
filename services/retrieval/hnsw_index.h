#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "core/bytes.h"
#include "core/result.h"
#include "retrieval/int8_vector.h"

namespace skein {

struct HnswOptions {
  size_t ef_construction = 200;
  size_t ef_search = 200;  // SearchBreadth; at least as broad as insertion's
  bool exact = false;      // search by scanning all vectors
};

constexpr size_t kInitialCapacity = 10'000;  // of an index; grows by doubling

// Breadth of a search among `size` photos: ef up to 100,000, then ef more with each tenfold. In a
// large index more photos are near by chance.
size_t SearchBreadth(size_t ef, size_t size);

struct Neighbour {
  int64_t id = 0;
  float distance = 0;  // Euclidean
};

// Vectors by id in a hierarchical navigable small world graph (Malkov and Yashunin 2018; hnswlib).
// Values are kept as one byte each (int8_vector.h). One thread owns the index: hnswlib must not
// insert while it searches. The graph depends on the order of insertion only, also across Encode
// and Decode.
class HnswIndex {
 public:
  HnswIndex(size_t dim, const HnswOptions& options);
  ~HnswIndex();
  HnswIndex(HnswIndex&&) noexcept;
  HnswIndex& operator=(HnswIndex&&) noexcept;

  using Nodes = std::vector<std::pair<float, uint32_t>>;  // squared distance, node
  // Result of a search for a vector of dim() values; input of Nearest and Insert.
  struct Search {
    Int8Vector vector;
    size_t index_size = 0;
    std::vector<Nodes> found;  // on each level, the lowest first; nearest first
  };
  Search Find(const float* vector) const;
  // At most k, nearest first, equally near ones by id; removed ones are left out. With `exact` by
  // comparing with every vector.
  std::vector<Neighbour> Nearest(const Search& search, size_t k) const;
  // The results in the order of an expanded query (Chum et al. 2007; weights: Radenovic et al.
  // 2019),
  //
  //   q = v + sum of max(0, cos(v, n)) n,   v: the vector, n: its `num_expanding` nearest.
  //
  // Photos similar to the likely neighbours come before photos similar by chance. For vectors of
  // unit length. Distances are the vector's own.
  std::vector<Neighbour> NearestExpanded(const Search& search, size_t k,
                                         size_t num_expanding) const;
  // Throws std::invalid_argument if the id was inserted before, or if anything was inserted since
  // the search.
  void Insert(int64_t id, const Search& search);

  // The same with a search of their own.
  void Insert(int64_t id, const float* vector) { Insert(id, Find(vector)); }
  std::vector<Neighbour> Query(const float* vector, size_t k) const {
    return Nearest(Find(vector), k);
  }
  // By comparing with every vector, whatever the options.
  std::vector<Neighbour> QueryExact(const float* vector, size_t k) const {
    return Best(Scan(ToInt8(vector, dim_)), k);
  }

  // Not found by queries any more, until Restore. No effect on ids that are not here.
  void Remove(int64_t id);
  void Restore(int64_t id);

  bool Contains(int64_t id) const;  // removed ones, too
  size_t size() const;              // with removed ones
  size_t capacity() const;
  size_t dim() const { return dim_; }

  // hnswlib's own format. Decode trusts the bytes apart from dimension and size, so the caller adds
  // a checksum.
  Bytes Encode() const;
  static Result<HnswIndex> Decode(const Bytes& bytes, size_t dim, const HnswOptions& options);

 private:
  struct Graph;
  HnswIndex(size_t dim, const HnswOptions& options, std::unique_ptr<Graph> graph);

  Nodes Scan(const Int8Vector& vector) const;
  Nodes FoundBy(const Search& search) const;
  std::vector<Neighbour> Best(const Nodes& nodes, size_t k) const;

  size_t dim_;
  HnswOptions options_;
  std::unique_ptr<Graph> graph_;
};

}  // namespace skein
