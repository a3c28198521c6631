#include "retrieval/hnsw_index.h"

#include <hnswlib/hnswlib.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <string>
#include <utility>

#include "core/file.h"

namespace skein {
namespace {

// A file in memory: hnswlib reads and writes files by name only.
class MemoryFile {
 public:
  MemoryFile() : fd_(::memfd_create("hnsw", MFD_CLOEXEC)) {
    if (fd_ < 0) throw std::runtime_error("memfd_create failed");
  }
  ~MemoryFile() { ::close(fd_); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  std::string path() const { return "/proc/self/fd/" + std::to_string(fd_); }

  void Write(const Bytes& bytes) {
    for (size_t done = 0; done < bytes.size();) {
      const ssize_t written = ::write(fd_, bytes.data() + done, bytes.size() - done);
      if (written <= 0) throw std::runtime_error("not enough memory to load the index");
      done += static_cast<size_t>(written);
    }
  }

 private:
  int fd_;
};

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define SKEIN_FASTEST_SUPPORTED __attribute__((target_clones("avx512f", "arch=haswell", "default")))
#else
#define SKEIN_FASTEST_SUPPORTED
#endif

// Squared Euclidean distance of two vectors of *dim floats, in the way of the processor it runs on.
// hnswlib's own is fixed when compiled, and waits for one sum; these are four.
SKEIN_FASTEST_SUPPORTED
float DistanceSq(const void* a, const void* b, const void* dim) {
  using Lanes = float __attribute__((vector_size(64)));
  constexpr size_t kLanes = 16, kSums = 4;
  const auto* x = static_cast<const float*>(a);
  const auto* y = static_cast<const float*>(b);
  const size_t n = *static_cast<const size_t*>(dim);
  Lanes sums[kSums] = {};
  size_t i = 0;
  for (; i + kLanes * kSums <= n; i += kLanes * kSums) {
    for (size_t k = 0; k < kSums; ++k) {
      Lanes u, v;
      std::memcpy(&u, x + i + k * kLanes, sizeof(u));
      std::memcpy(&v, y + i + k * kLanes, sizeof(v));
      sums[k] += (u - v) * (u - v);
    }
  }
  const Lanes all = (sums[0] + sums[1]) + (sums[2] + sums[3]);
  float sum = 0;
  for (size_t k = 0; k < kLanes; ++k) sum += all[k];
  for (; i < n; ++i) sum += (x[i] - y[i]) * (x[i] - y[i]);
  return sum;
}

class EuclideanSpace : public hnswlib::SpaceInterface<float> {
 public:
  explicit EuclideanSpace(size_t dim) : dim_(dim) {}
  size_t get_data_size() override { return dim_ * sizeof(float); }
  hnswlib::DISTFUNC<float> get_dist_func() override { return DistanceSq; }
  void* get_dist_func_param() override { return &dim_; }

 private:
  size_t dim_;
};

// Spreads ids over the seeds of hnswlib's level generator (SplitMix64).
uint32_t LevelSeed(int64_t id) {
  uint64_t z = static_cast<uint64_t>(id) + 0x9e3779b97f4a7c15ULL;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  return static_cast<uint32_t>((z ^ (z >> 31)) % 2147483646ULL) + 1;
}

bool Nearer(const Neighbour& a, const Neighbour& b) {
  return a.distance != b.distance ? a.distance < b.distance : a.id < b.id;
}

}  // namespace

struct HnswIndex::Graph {
  using Hnsw = hnswlib::HierarchicalNSW<float>;

  Graph(size_t dim, const HnswOptions& o)
      : space(dim), hnsw(&space, o.initial_capacity, o.M, o.ef_construction) {
    hnsw.setEf(o.ef_search);
  }
  // hnswlib forgets ef when it loads.
  Graph(size_t dim, const HnswOptions& o, const std::string& path)
      : space(dim), hnsw(&space, path, false, o.initial_capacity) {
    hnsw.setEf(o.ef_search);
  }

  const hnswlib::tableint* Find(int64_t id) const {
    const auto found = hnsw.label_lookup_.find(static_cast<hnswlib::labeltype>(id));
    return found == hnsw.label_lookup_.end() ? nullptr : &found->second;
  }

  EuclideanSpace space;
  Hnsw hnsw;
};

HnswIndex::HnswIndex(size_t dim, const HnswOptions& options)
    : dim_(dim), options_(options), graph_(std::make_unique<Graph>(dim, options)) {}

HnswIndex::~HnswIndex() = default;
HnswIndex::HnswIndex(HnswIndex&&) noexcept = default;
HnswIndex& HnswIndex::operator=(HnswIndex&&) noexcept = default;

void HnswIndex::Insert(int64_t id, const float* vector) {
  if (Contains(id)) throw std::invalid_argument("index holds " + std::to_string(id) + " already");
  auto& hnsw = graph_->hnsw;
  if (size() == capacity()) hnsw.resizeIndex(std::max<size_t>(1, 2 * capacity()));
  hnsw.level_generator_.seed(LevelSeed(id));
  hnsw.addPoint(vector, static_cast<hnswlib::labeltype>(id));
}

std::vector<Neighbour> HnswIndex::Query(const float* vector, size_t k) const {
  if (options_.exact) return QueryExact(vector, k);
  std::vector<Neighbour> found;
  for (auto queue = graph_->hnsw.searchKnn(vector, k); !queue.empty(); queue.pop()) {
    found.push_back({static_cast<int64_t>(queue.top().second), std::sqrt(queue.top().first)});
  }
  std::sort(found.begin(), found.end(), Nearer);
  return found;
}

std::vector<Neighbour> HnswIndex::QueryExact(const float* vector, size_t k) const {
  const auto& hnsw = graph_->hnsw;
  std::vector<Neighbour> found;
  for (hnswlib::tableint i = 0; i < hnsw.cur_element_count; ++i) {
    if (hnsw.isMarkedDeleted(i)) continue;
    const float distance_sq =
        hnsw.fstdistfunc_(vector, hnsw.getDataByInternalId(i), hnsw.dist_func_param_);
    found.push_back({static_cast<int64_t>(hnsw.getExternalLabel(i)), std::sqrt(distance_sq)});
  }
  const auto end = found.begin() + static_cast<std::ptrdiff_t>(std::min(k, found.size()));
  std::partial_sort(found.begin(), end, found.end(), Nearer);
  found.erase(end, found.end());
  return found;
}

void HnswIndex::Remove(int64_t id) {
  const auto* internal = graph_->Find(id);
  if (internal && !graph_->hnsw.isMarkedDeleted(*internal)) {
    graph_->hnsw.markDeletedInternal(*internal);
  }
}

void HnswIndex::Restore(int64_t id) {
  const auto* internal = graph_->Find(id);
  if (internal && graph_->hnsw.isMarkedDeleted(*internal)) {
    graph_->hnsw.unmarkDeletedInternal(*internal);
  }
}

bool HnswIndex::Contains(int64_t id) const { return graph_->Find(id) != nullptr; }
size_t HnswIndex::size() const { return graph_->hnsw.cur_element_count; }
size_t HnswIndex::capacity() const { return graph_->hnsw.max_elements_; }
size_t HnswIndex::BytesPerVector() const { return graph_->hnsw.size_data_per_element_; }

Bytes HnswIndex::Encode() const {
  const MemoryFile file;
  graph_->hnsw.saveIndex(file.path());
  auto bytes = ReadFile(file.path());
  if (!bytes) throw std::runtime_error("index cannot be saved: " + bytes.error());
  return std::move(*bytes);
}

Result<HnswIndex> HnswIndex::Decode(const Bytes& bytes, size_t dim, const HnswOptions& options) {
  try {
    MemoryFile file;
    file.Write(bytes);
    HnswIndex index(dim,
                    HnswOptions{options.M, options.ef_construction, options.ef_search, 1, false});
    index.graph_ = std::make_unique<Graph>(dim, options, file.path());
    index.options_ = options;
    const auto& hnsw = index.graph_->hnsw;
    if (hnsw.label_offset_ - hnsw.offsetData_ != dim * sizeof(float)) {
      return Status::Error("index holds vectors of another dimension");
    }
    return index;
  } catch (const std::runtime_error& e) {
    return Status::Error(e.what());
  }
}

}  // namespace skein
