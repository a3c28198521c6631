#include "retrieval/hnsw_index.h"

#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "core/file.h"
#include "retrieval/graph_check.h"
#include "retrieval/hnsw_graph.h"

namespace skein {
namespace {

constexpr size_t kM = 16;  // links of a node on a level, as hnswlib's default

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

int64_t IdOf(const HnswGraph& graph, HnswGraph::Node node) {
  return static_cast<int64_t>(graph.getExternalLabel(node));
}

}  // namespace

size_t SearchBreadth(size_t ef, size_t size) {
  constexpr double kLarge = 100'000;
  const double tenfolds = std::log10(std::max(1.0, static_cast<double>(size) / kLarge));
  return static_cast<size_t>(std::lround(static_cast<double>(ef) * (1 + tenfolds)));
}

struct HnswIndex::Graph {
  Graph(size_t dim, const HnswOptions& o)
      : space(dim), hnsw(&space, kInitialCapacity, kM, o.ef_construction) {}
  Graph(size_t dim, const std::string& path) : space(dim), hnsw(&space, path, kInitialCapacity) {}

  const HnswGraph::Node* Find(int64_t id) const {
    const auto found = hnsw.label_lookup_.find(static_cast<hnswlib::labeltype>(id));
    return found == hnsw.label_lookup_.end() ? nullptr : &found->second;
  }

  Int8Space space;
  HnswGraph hnsw;
};

HnswIndex::HnswIndex(size_t dim, const HnswOptions& options)
    : HnswIndex(dim, options, std::make_unique<Graph>(dim, options)) {}

HnswIndex::HnswIndex(size_t dim, const HnswOptions& options, std::unique_ptr<Graph> graph)
    : dim_(dim), options_(options), graph_(std::move(graph)) {}

HnswIndex::~HnswIndex() = default;
HnswIndex::HnswIndex(HnswIndex&&) noexcept = default;
HnswIndex& HnswIndex::operator=(HnswIndex&&) noexcept = default;

HnswIndex::Search HnswIndex::Find(const float* vector) const {
  Search search;
  search.vector = ToInt8(vector, dim_);
  search.index_size = size();
  const size_t ef = SearchBreadth(std::max(options_.ef_search, options_.ef_construction), size());
  search.found = graph_->hnsw.Search(search.vector.data(), ef);
  return search;
}

HnswIndex::Nodes HnswIndex::FoundBy(const Search& search) const {
  if (options_.exact) return Scan(search.vector);
  return search.found.empty() ? Nodes() : search.found[0];
}

std::vector<Neighbour> HnswIndex::Nearest(const Search& search, size_t k) const {
  return Best(FoundBy(search), k);
}

std::vector<Neighbour> HnswIndex::NearestExpanded(const Search& search, size_t k,
                                                  size_t num_expanding) const {
  const auto& hnsw = graph_->hnsw;
  const auto cosine = [](float distance_sq) { return 1 - distance_sq / 2; };
  const Nodes nodes = FoundBy(search);
  std::vector<std::pair<float, Neighbour>> scored;
  for (const auto& [distance_sq, node] : nodes) {
    float score = cosine(distance_sq);
    for (size_t i = 0; i < std::min(num_expanding, nodes.size()); ++i) {
      const float weight = std::max(0.f, cosine(nodes[i].first));
      score += weight * cosine(hnsw.DistanceSq(hnsw.getDataByInternalId(nodes[i].second), node));
    }
    scored.push_back({score, {IdOf(hnsw, node), std::sqrt(distance_sq)}});
  }
  std::sort(scored.begin(), scored.end(), [](const auto& a, const auto& b) {
    return a.first != b.first ? a.first > b.first : Nearer(a.second, b.second);
  });
  std::vector<Neighbour> best;
  for (size_t i = 0; i < std::min(k, scored.size()); ++i) best.push_back(scored[i].second);
  return best;
}

void HnswIndex::Insert(int64_t id, const Search& search) {
  if (Contains(id)) throw std::invalid_argument("index holds " + std::to_string(id) + " already");
  if (search.index_size != size())
    throw std::invalid_argument("the search is older than the index");
  auto& hnsw = graph_->hnsw;
  if (size() == capacity()) hnsw.Grow(std::max<size_t>(1, 2 * capacity()));
  hnsw.level_generator_.seed(LevelSeed(id));
  hnsw.Insert(search.vector.data(), static_cast<hnswlib::labeltype>(id),
              hnsw.getRandomLevel(hnsw.mult_), search.found);
}

HnswIndex::Nodes HnswIndex::Scan(const Int8Vector& vector) const {
  const auto& hnsw = graph_->hnsw;
  Nodes nodes;
  for (HnswGraph::Node node = 0; node < hnsw.cur_element_count; ++node) {
    if (!hnsw.isMarkedDeleted(node)) {
      nodes.emplace_back(hnsw.DistanceSq(vector.data(), node), node);
    }
  }
  std::sort(nodes.begin(), nodes.end());
  return nodes;
}

std::vector<Neighbour> HnswIndex::Best(const Nodes& nodes, size_t k) const {
  std::vector<Neighbour> neighbours;
  for (const auto& [distance_sq, node] : nodes) {
    neighbours.push_back({IdOf(graph_->hnsw, node), std::sqrt(distance_sq)});
  }
  const auto end = neighbours.begin() + static_cast<std::ptrdiff_t>(std::min(k, neighbours.size()));
  std::partial_sort(neighbours.begin(), end, neighbours.end(), Nearer);
  neighbours.erase(end, neighbours.end());
  return neighbours;
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

Bytes HnswIndex::Encode() const {
  const MemoryFile file;
  graph_->hnsw.saveIndex(file.path());
  auto bytes = ReadFile(file.path());
  if (!bytes) throw std::runtime_error("index cannot be saved: " + bytes.error());
  return std::move(*bytes);
}

Result<HnswIndex> HnswIndex::Decode(const Bytes& bytes, size_t dim, const HnswOptions& options) {
  if (Status sound = CheckGraph(bytes, dim); !sound.ok()) return sound;
  try {
    MemoryFile file;
    file.Write(bytes);
    return HnswIndex(dim, options, std::make_unique<Graph>(dim, file.path()));
  } catch (const std::runtime_error& e) {
    return DataLoss(e.what());
  }
}

}  // namespace skein
