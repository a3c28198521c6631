// Random numbers, vectors and rotations for tests. The generator, and so its seed, is the test's.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <random>

namespace skein {

inline double Uniform(double low, double high, std::mt19937* random) {
  return std::uniform_real_distribution<double>(low, high)(*random);
}

inline Eigen::Vector3d Uniform3(double low, double high, std::mt19937* random) {
  const double x = Uniform(low, high, random), y = Uniform(low, high, random);
  return {x, y, Uniform(low, high, random)};
}

inline double Normal(double sigma, std::mt19937* random) {
  return std::normal_distribution<double>(0, sigma)(*random);
}

inline Eigen::Vector3d Normal3(double sigma, std::mt19937* random) {
  std::normal_distribution<double> normal(0, sigma);
  const double x = normal(*random), y = normal(*random), z = normal(*random);
  return {x, y, z};
}

// Uniform over all rotations.
inline Eigen::Quaterniond RandomRotation(std::mt19937* random) {
  const Eigen::Vector3d xyz = Normal3(1, random);
  return Eigen::Quaterniond(Normal(1, random), xyz.x(), xyz.y(), xyz.z()).normalized();
}

}  // namespace skein
