#include "clients/places/crowd.h"

#include <algorithm>
#include <cmath>

#include "clients/places/outdoors.h"
#include "clients/places/solids.h"

namespace skein::sim {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kNearestM = 1.6;         // a passer-by to the camera
constexpr double kMonumentRadiusM = 2.7;  // nobody walks there

Isometry3d Standing(const Vector2d& at, double yaw_rad) {
  return Eigen::Translation3d(at.x(), at.y(), 0) * Eigen::AngleAxisd(yaw_rad, Vector3d::UnitZ());
}

Clothes RandomClothes(int paint, int cloth, Random* random) {
  Clothes clothes;
  const float skin = static_cast<float>(random->Uniform(0.35, 0.95));
  clothes.skin = {paint, Eigen::Vector3f(0.62f, 0.75f, 1.05f) * skin, 0.02f};
  const float hair = static_cast<float>(random->Uniform(0.08, 0.5));
  clothes.hair = {cloth, Eigen::Vector3f(0.6f, 0.8f, 1) * hair, 0.1f};
  clothes.upper = Tinted(cloth, 0.12, 1.05, 0.3, random);
  clothes.lower = Tinted(cloth, 0.1, 0.6, 0.15, random);
  return clothes;
}

// Between the camera and somewhat behind the monument, within the photo's width.
Vector2d PasserPlace(const Pose& pose, double from, double to, Random* random) {
  const Vector2d eye = pose.center.head<2>();
  const Vector3d forward = pose.cam_from_world.conjugate() * Vector3d::UnitZ();
  const double distance = std::max(kNearestM, eye.norm() * random->Uniform(from, to));
  const Eigen::Rotation2Dd aside(random->Uniform(-28, 28) * kDegree);
  return eye + distance * (aside * forward.head<2>().normalized());
}

}  // namespace

void AddMonumentSquare(uint64_t seed, PlaceBuilder* builder) {
  Random random(seed);
  SquareSpec square;
  square.seed = random.Next();
  square.building = false;
  square.neat = true;
  AddSquare(square, builder);
  const Material stone{builder->RandomTrim(&random), {1.0f, 1.05f, 1.1f}, 0.3f};
  const Material bronze{builder->RandomTrim(&random), {0.42f, 0.5f, 0.42f}, 0.3f};
  std::vector<Surface> surfaces;
  AddMonument(Standing({0, 0}, 0), stone, bronze, &random, &surfaces);
  builder->AddSurfaces(surfaces);
}

// Most stand in front of the monument, which looks to -y.
Pose TouristPose(Random* random) {
  const double angle = -90 * kDegree + std::clamp(random->Gaussian() * 38, -100.0, 100.0) * kDegree;
  const double distance = 5.5 * std::pow(3.2, random->Unit());
  const Vector3d center(distance * std::cos(angle), distance * std::sin(angle),
                        random->Uniform(1.3, 1.85));
  const Vector3d target(random->Gaussian() * 0.07 * distance, random->Gaussian() * 0.07 * distance,
                        2.6 + 0.04 * distance + random->Gaussian() * 0.4);
  return LookAt(center, target, random->Gaussian() * 1.6 * kDegree);
}

TouristCamera MakeTouristCamera(int max_side_px, Random* random) {
  const double ratio = random->Chance(0.6) ? 0.75 : 2.0 / 3;
  const int longer = static_cast<int>(max_side_px * random->Uniform(0.7, 1));
  const int shorter = static_cast<int>(longer * ratio);
  const bool portrait = random->Chance(0.4);
  Camera camera;
  camera.width = portrait ? shorter : longer;
  camera.height = portrait ? longer : shorter;
  camera.focal_px = longer * random->Uniform(0.72, 1.45);
  camera.distortion = random->Uniform(-0.12, 0.04);
  if (random->Chance(0.5)) {
    const auto cut = [&](int side) { return static_cast<int>(side * random->Uniform(0, 0.2)); };
    const int less_x = cut(camera.width), less_y = cut(camera.height);
    camera = Crop(camera, {random->Chance(0.5) ? less_x : 0, random->Chance(0.5) ? less_y : 0,
                           camera.width - less_x, camera.height - less_y});
  }
  return {camera, static_cast<double>(longer)};
}

Exposure TouristExposure(Random* random) {
  Exposure exposure;
  exposure.gain = std::exp(random->Uniform(-0.55, 0.4));
  exposure.vignetting = random->Uniform(0, 0.3);
  exposure.noise_sigma = random->Uniform(0.6, 2.5);
  exposure.shadow_noise = random->Uniform(0, 9);
  exposure.softness_px = random->Uniform(0, 0.9);
  const float warm = static_cast<float>(random->Uniform(-0.1, 0.1));
  exposure.white_balance = {1 - warm, 1, 1 + warm};
  exposure.seed = random->Next();
  return exposure;
}

std::vector<Surface> PassersBy(const Pose& pose, int paint, int cloth, Random* random) {
  std::vector<Surface> surfaces;
  const bool close = random->Chance(0.3);
  for (int i = random->Int(2, 9); i >= 0; --i) {
    const Vector2d at = i == 0 && close ? PasserPlace(pose, 0.15, 0.35, random)
                                        : PasserPlace(pose, 0.4, 1.3, random);
    const Clothes clothes = RandomClothes(paint, cloth, random);
    const double height = random->Uniform(1.35, 1.9), yaw = random->Uniform(0, 2 * M_PI);
    if (at.norm() < kMonumentRadiusM) continue;
    AddPerson(Standing(at, yaw), height, clothes, random, &surfaces);
  }
  for (int i = random->Int(0, 2); i > 0; --i) {
    const Vector2d at = PasserPlace(pose, 1.5, 2.1, random);
    const Material body = Tinted(paint, 0.15, 1.1, 0.15, random);
    const Material dark{paint, Eigen::Vector3f::Constant(0.16f), 0.02f};
    const double yaw = random->Uniform(0, 2 * M_PI);
    if (at.norm() < 2 * kMonumentRadiusM || at.norm() > kRingFrontM - 3) continue;
    AddCar(Standing(at, yaw), body, dark, &surfaces);
  }
  return surfaces;
}

}  // namespace skein::sim
