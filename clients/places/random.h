// A small seeded generator (SplitMix64). Its sequence is the same on every platform, unlike
// std::uniform_real_distribution's. So a place is a function of its seed.
#pragma once

#include <cmath>
#include <cstdint>

namespace skein::sim {

class Random {
 public:
  explicit Random(uint64_t seed) : state_(seed) {}

  uint64_t Next() {
    uint64_t z = (state_ += 0x9e3779b97f4a7c15ULL);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
    return z ^ (z >> 31);
  }
  // In [0, 1).
  double Unit() { return static_cast<double>(Next() >> 11) * 0x1.0p-53; }
  double Uniform(double low, double high) { return low + (high - low) * Unit(); }
  // In [low, high].
  int Int(int low, int high) { return low + static_cast<int>(Next() % (high - low + 1)); }
  bool Chance(double probability) { return Unit() < probability; }
  double Gaussian() {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - Unit()));
    return radius * std::cos(2.0 * M_PI * Unit());
  }
  // A generator for part `key` of whatever this one is for; does not advance this one.
  Random Fork(uint64_t key) const {
    Random mixed(state_ ^ (key * 0xd1342543de82ef95ULL + 0x632be59bd9b4e019ULL));
    return Random(mixed.Next());
  }

 private:
  uint64_t state_;
};

}  // namespace skein::sim
