#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <unordered_map>

namespace skein {

// Space in cubes: an index for each occupied one.
class Cells {
 public:
  using Cell = std::array<int32_t, 3>;

  explicit Cells(double width) : width_(width) {}

  // nullopt for a place too far away to have a cell.
  std::optional<Cell> CellOf(const Eigen::Vector3d& xyz) const {
    const Eigen::Array3d scaled = (xyz.array() / width_).floor();
    if (!(scaled.abs() < kMax).all()) return std::nullopt;
    return Cell{static_cast<int32_t>(scaled.x()), static_cast<int32_t>(scaled.y()),
                static_cast<int32_t>(scaled.z())};
  }

  // The index of the cell, a new one where it was not occupied.
  uint32_t Occupy(const Cell& cell) {
    return index_.emplace(KeyOf(cell), static_cast<uint32_t>(index_.size())).first->second;
  }

  // Null if it is not occupied.
  const uint32_t* Find(const Cell& cell) const {
    const auto found = index_.find(KeyOf(cell));
    return found == index_.end() ? nullptr : &found->second;
  }

  // visit(index) for the occupied cells at most `radius` cells away along each axis, itself too.
  template <class Visit>
  void VisitAround(const Cell& cell, int radius, Visit visit) const {
    for (int x = -radius; x <= radius; ++x) {
      for (int y = -radius; y <= radius; ++y) {
        for (int z = -radius; z <= radius; ++z) {
          if (const uint32_t* index = Find({cell[0] + x, cell[1] + y, cell[2] + z})) visit(*index);
        }
      }
    }
  }

  size_t size() const { return index_.size(); }
  double width() const { return width_; }

 private:
  static constexpr int32_t kMax = 1 << 20;

  static uint64_t KeyOf(const Cell& cell) {
    uint64_t key = 0;
    for (const int32_t c : cell) key = key << 21 | (static_cast<uint64_t>(c + kMax) & 0x1fffff);
    return key;
  }
  struct Hash {
    size_t operator()(uint64_t key) const {  // splitmix64's finish
      key = (key ^ (key >> 30)) * 0xbf58476d1ce4e5b9u;
      key = (key ^ (key >> 27)) * 0x94d049bb133111ebu;
      return key ^ (key >> 31);
    }
  };

  double width_;
  std::unordered_map<uint64_t, uint32_t, Hash> index_;
};

}  // namespace skein
