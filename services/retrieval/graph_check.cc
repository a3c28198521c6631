#include "retrieval/graph_check.h"

#include <cmath>
#include <cstdint>
#include <cstring>
#include <vector>

#include "retrieval/int8_vector.h"

namespace skein {
namespace {

using Node = uint32_t;
using ListSize =
    uint32_t;  // its number of links in the first 16 bits, then a mark of a removed one

constexpr uint64_t kMaxLinks = 10'000;        // hnswlib's own limit of M
constexpr uint64_t kMaxBreadth = 1'000'000;   // ef_construction
constexpr uint64_t kMaxCapacity = 1'000'000;  // beyond twice what is in the graph
constexpr int kMaxLevel = 64;

// hnswlib's saveIndex writes these in order.
struct Header {
  uint64_t offset_level0 = 0, capacity = 0, size = 0, node_bytes = 0, label_at = 0, vector_at = 0;
  int32_t max_level = 0;
  Node entry = 0;
  uint64_t max_links = 0, max_links0 = 0, M = 0;
  double level_scale = 0;
  uint64_t ef_construction = 0;

  bool Read(ByteReader* in) {
    return in->Get(&offset_level0) && in->Get(&capacity) && in->Get(&size) &&
           in->Get(&node_bytes) && in->Get(&label_at) && in->Get(&vector_at) &&
           in->Get(&max_level) && in->Get(&entry) && in->Get(&max_links) && in->Get(&max_links0) &&
           in->Get(&M) && in->Get(&level_scale) && in->Get(&ef_construction);
  }
  uint64_t links_bytes(uint64_t links) const { return sizeof(ListSize) + links * sizeof(Node); }
  bool IsSound(size_t vector_bytes) const {
    const bool links = M >= 2 && M <= kMaxLinks && max_links == M && max_links0 == 2 * M;
    const bool layout = offset_level0 == 0 && vector_at == links_bytes(max_links0) &&
                        label_at == vector_at + vector_bytes &&
                        node_bytes == label_at + sizeof(uint64_t);
    const bool numbers = std::isfinite(level_scale) && level_scale > 0 && ef_construction > 0 &&
                         ef_construction <= kMaxBreadth && max_level >= -1 &&
                         max_level <= kMaxLevel && size <= UINT32_MAX && capacity >= size &&
                         capacity <= 2 * size + kMaxCapacity;
    return links && layout && numbers && (size == 0 || entry < size);
  }
};

bool IsVector(const uint8_t* stored, size_t dim) {
  float scale = 0;
  int32_t sum_of_squares = 0;
  std::memcpy(&scale, stored, sizeof(scale));
  std::memcpy(&sum_of_squares, stored + sizeof(scale), sizeof(sum_of_squares));
  const auto* q = reinterpret_cast<const int8_t*>(stored + sizeof(scale) + sizeof(sum_of_squares));
  int64_t sum = 0;
  for (size_t i = 0; i < dim; ++i) sum += int64_t{q[i]} * q[i];
  return std::isfinite(scale) && scale >= 0 && sum == sum_of_squares;
}

class GraphChecker {
 public:
  GraphChecker(const Bytes& saved, size_t dim) : in_(saved), dim_(dim) {}

  bool IsSound() {
    if (!header_.Read(&in_) || !header_.IsSound(Int8VectorSize(dim_))) return false;
    if (header_.size > in_.remaining() / header_.node_bytes) return false;
    level0_ = in_.data();
    in_.Skip(static_cast<size_t>(header_.size * header_.node_bytes));
    if (!ReadUpperLists()) return false;
    if (header_.size > 0 && level_of_[header_.entry] != header_.max_level) return false;
    for (Node node = 0; node < header_.size; ++node) {
      if (!IsSoundNode(node)) return false;
    }
    return true;
  }

 private:
  // For each node the size of its lists above level 0, then these.
  bool ReadUpperLists() {
    const uint64_t list_bytes = header_.links_bytes(header_.max_links);
    for (uint64_t node = 0; node < header_.size; ++node) {
      uint32_t size = 0;
      if (!in_.Get(&size) || size % list_bytes != 0 || size > in_.remaining()) return false;
      level_of_.push_back(static_cast<int>(size / list_bytes));
      if (level_of_.back() > header_.max_level) return false;
      upper_of_.push_back(in_.data());
      in_.Skip(size);
    }
    return in_.remaining() == 0;
  }

  bool IsSoundNode(Node node) const {
    const uint8_t* at = level0_ + node * header_.node_bytes;
    if (!IsSoundList(at, 0, header_.max_links0) || !IsVector(at + header_.vector_at, dim_)) {
      return false;
    }
    for (int level = 1; level <= level_of_[node]; ++level) {
      const auto lists = static_cast<size_t>(level - 1);
      if (!IsSoundList(upper_of_[node] + lists * header_.links_bytes(header_.max_links), level,
                       header_.max_links)) {
        return false;
      }
    }
    return true;
  }

  // A node that a list of a level names has that level.
  bool IsSoundList(const uint8_t* list, int level, uint64_t max_links) const {
    uint16_t count = 0;
    std::memcpy(&count, list, sizeof(count));
    if (count > max_links) return false;
    for (uint16_t i = 0; i < count; ++i) {
      Node other = 0;
      std::memcpy(&other, list + sizeof(ListSize) + i * sizeof(Node), sizeof(other));
      if (other >= header_.size || level_of_[other] < level) return false;
    }
    return true;
  }

  ByteReader in_;
  const size_t dim_;
  Header header_;
  const uint8_t* level0_ = nullptr;
  std::vector<int> level_of_;
  std::vector<const uint8_t*> upper_of_;
};

}  // namespace

Status CheckGraph(const Bytes& saved, size_t dim) {
  if (GraphChecker(saved, dim).IsSound()) return Status::Ok();
  return DataLoss("index is damaged, or of vectors of another dimension");
}

}  // namespace skein
