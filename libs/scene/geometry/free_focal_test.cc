#include "geometry/free_focal.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>

#include "testing/test_random.h"

namespace skein::free_focal_test {

constexpr double kBelievedPx = 1200, kNoisePx = 0.5;

// Points before two cameras at distance 8. The photos are 1000 x 750.
struct Scene {
  double turn_deg = 15;  // of the second photo's place around the points
  double first_px = kBelievedPx, second_px = kBelievedPx;
  double distortion = 0;
  double depth = 2;                 // half the range of the points' depths
  Eigen::Vector3d step{0, 0.4, 0};  // of the second photo, besides
  bool stays = false;               // the second photo is turned where the first one is
  unsigned seed = 1;
};

PairPixels Photograph(const Scene& scene) {
  constexpr int kNumPoints = 600;
  std::mt19937 random(scene.seed);
  std::normal_distribution<double> noise(0, kNoisePx);
  const double turn = scene.turn_deg * M_PI / 180;
  const Eigen::Vector3d first_center(0, 0, -8);
  const Eigen::Matrix3d R = Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitY()).matrix();
  const Eigen::Vector3d second_center =
      scene.stays ? first_center : R.transpose() * first_center + scene.step;
  const auto project = [&](const Eigen::Vector3d& point, double focal_px) {
    const Eigen::Vector2d u = point.hnormalized();
    return Eigen::Vector2d(focal_px * (1 + scene.distortion * u.squaredNorm()) * u +
                           Eigen::Vector2d(noise(random), noise(random)));
  };
  const auto is_seen = [](const Eigen::Vector2d& pixel) {
    return std::abs(pixel.x()) < 500 && std::abs(pixel.y()) < 375;
  };
  PairPixels pixels;
  for (int i = 0; i < kNumPoints; ++i) {
    const Eigen::Vector3d point(Uniform(-4, 4, &random), Uniform(-3, 3, &random),
                                scene.depth * Uniform(-1, 1, &random));
    const Eigen::Vector3d in_first = point - first_center, in_second = R * (point - second_center);
    if (in_first.z() < 0.1 || in_second.z() < 0.1) continue;
    const Eigen::Vector2d first = project(in_first, scene.first_px);
    const Eigen::Vector2d second = project(in_second, scene.second_px);
    if (!is_seen(first) || !is_seen(second)) continue;
    pixels.first.push_back(first);
    pixels.second.push_back(second);
  }
  return pixels;
}

TwoViewBeliefs Guesses() { return {{kBelievedPx, 0.3}, {kBelievedPx, 0.3}}; }

TEST(Rotation, NeedsMatches) {
  Scene scene;
  scene.stays = true;
  PairPixels pixels = Photograph(scene);
  pixels.first.resize(10);
  pixels.second.resize(10);
  EXPECT_FALSE(IsRotation(pixels, Guesses()));
}

TEST(Rotation, IsKnownWhateverTheFocalLengthAndTheLens) {
  for (const double focal_px : {700.0, 1200.0, 1800.0}) {
    for (const double distortion : {0.0, -0.15}) {
      for (const double zoom : {1.0, 1.3}) {
        Scene scene;
        scene.stays = true;
        scene.first_px = focal_px;
        scene.second_px = zoom * focal_px;
        scene.distortion = distortion;
        EXPECT_TRUE(IsRotation(Photograph(scene), Guesses()))
            << focal_px << " " << distortion << " " << zoom;
      }
    }
  }
}

TEST(Rotation, IsNoWallBeforeAMovingCamera) {
  for (const double turn_deg : {0.0, 15.0}) {
    for (const double sideways : {0.8, 2.0}) {
      Scene scene;
      scene.depth = 0;
      scene.turn_deg = turn_deg;
      scene.step = {sideways, 0.1, 0};
      EXPECT_FALSE(IsRotation(Photograph(scene), Guesses())) << turn_deg << " " << sideways;
    }
  }
}

TEST(Rotation, IsNoMotionWithParallax) {
  for (const double turn_deg : {2.0, 15.0}) {
    Scene scene;
    scene.turn_deg = turn_deg;
    scene.step = {0.1, 0, 0};
    EXPECT_FALSE(IsRotation(Photograph(scene), Guesses())) << turn_deg;
  }
}

}  // namespace skein::free_focal_test
