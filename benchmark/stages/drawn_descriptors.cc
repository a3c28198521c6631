#include "benchmark/stages/drawn_descriptors.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <stdexcept>
#include <utility>

namespace skein::benchmark {
namespace {

constexpr float kNoise = 0.1f;  // length of the noise added to a vector of unit length
constexpr int64_t kBlock = 1000;

std::mt19937_64 RandomFor(uint64_t seed, uint64_t kind, uint64_t index) {
  std::seed_seq sequence{seed, kind, index};
  return std::mt19937_64(sequence);
}

bool Nearer(const ExactNeighbour& a, const ExactNeighbour& b) {
  return a.distance != b.distance ? a.distance < b.distance : a.photo < b.photo;
}

// Keeps the k nearest in a heap, the farthest first.
void Offer(const ExactNeighbour& candidate, size_t k, std::vector<ExactNeighbour>* heap) {
  if (heap->size() == k && !Nearer(candidate, heap->front())) return;
  if (heap->size() == k) {
    std::pop_heap(heap->begin(), heap->end(), Nearer);
    heap->pop_back();
  }
  heap->push_back(candidate);
  std::push_heap(heap->begin(), heap->end(), Nearer);
}

}  // namespace

DrawnDescriptors::DrawnDescriptors(std::vector<RowMatrix> sets, uint64_t seed)
    : sets_(std::move(sets)), seed_(seed) {
  if (sets_.empty()) throw std::invalid_argument("no descriptors to draw from");
  for (const RowMatrix& set : sets_) {
    if (set.rows() == 0 || set.cols() != dim()) throw std::invalid_argument("sets do not fit");
  }
  place_ = 1;  // none yet
  GoTo(0);
}

void DrawnDescriptors::GoTo(int64_t i) {
  while (starts_.back() <= i) {
    kinds_.push_back(RandomFor(seed_, 0, kinds_.size())() % sets_.size());
    starts_.push_back(starts_.back() + sets_[kinds_.back()].rows());
  }
  const auto after = std::upper_bound(starts_.begin(), starts_.end(), i);
  const auto place = static_cast<size_t>(after - starts_.begin()) - 1;
  if (std::exchange(place_, place) == place) return;
  auto random = RandomFor(seed_, 1, place);
  signs_.resize(dim());
  for (float& sign : signs_) sign = random() % 2 == 0 ? 1.f : -1.f;
}

int64_t DrawnDescriptors::PlaceOf(int64_t i) {
  GoTo(i);
  return static_cast<int64_t>(place_);
}

Eigen::RowVectorXf DrawnDescriptors::Get(int64_t i) {
  GoTo(i);
  auto random = RandomFor(seed_, 2, static_cast<uint64_t>(i));
  std::normal_distribution<float> normal(0, kNoise / std::sqrt(static_cast<float>(dim())));
  Eigen::RowVectorXf vector = sets_[kinds_[place_]].row(i - starts_[place_]).cwiseProduct(signs_);
  for (float& value : vector) value += normal(random);
  return vector.normalized();
}

ExactNeighbours FindExactly(DrawnDescriptors* drawn, const RowMatrix& queries, int64_t end,
                            const std::set<int64_t>& left_out, size_t k) {
  ExactNeighbours nearest(queries.rows());
  for (int64_t first = 0; first < end; first += kBlock) {
    RowMatrix block(std::min(kBlock, end - first), drawn->dim());
    for (Eigen::Index i = 0; i < block.rows(); ++i) block.row(i) = drawn->Get(first + i);
    const RowMatrix products = block * queries.transpose();
    for (Eigen::Index i = 0; i < block.rows(); ++i) {
      if (left_out.count(first + i) > 0) continue;
      for (Eigen::Index q = 0; q < queries.rows(); ++q) {
        const float distance_sq = std::max(0.f, 2 - 2 * products(i, q));
        Offer({first + i, std::sqrt(distance_sq)}, k, &nearest[q]);
      }
    }
  }
  for (auto& neighbours : nearest) std::sort_heap(neighbours.begin(), neighbours.end(), Nearer);
  return nearest;
}

}  // namespace skein::benchmark
