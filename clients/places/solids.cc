#include "clients/places/solids.h"

#include <cmath>

#include "clients/places/paint.h"

namespace skein::sim {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kColumnSides = 10;
constexpr int kConeSides = 64;

Isometry3d Moved(const Isometry3d& frame, double x, double y, double z) {
  return frame * Eigen::Translation3d(x, y, z);
}

// Swings about the frame's x axis, as an arm or a leg does.
Isometry3d Swung(const Isometry3d& frame, double angle_rad) {
  return frame * Eigen::AngleAxisd(angle_rad, Vector3d::UnitX());
}

// From the solid's own corners to the world.
void AddFace(const Isometry3d& frame, const Vector3d& origin, const Vector3d& right_end,
             const Vector3d& down_end, const Material& material, std::vector<Surface>* surfaces) {
  Surface surface;
  surface.origin = (frame * origin).cast<float>();
  surface.right = (frame.linear() * (right_end - origin)).cast<float>();
  surface.down = (frame.linear() * (down_end - origin)).cast<float>();
  surface.texture = material.texture;
  surface.tint = material.tint;
  surface.detail = material.detail;
  // Faces differ in what part of the texture they show.
  surface.uv = Eigen::Vector2f(0.37f, 0.73f) * static_cast<float>(surfaces->size() % 61);
  surfaces->push_back(surface);
}

// A ball from three columns.
void AddBall(const Isometry3d& foot, double radius_m, const Material& lower, const Material& upper,
             std::vector<Surface>* surfaces) {
  const double slim = 0.76 * radius_m;
  AddColumn(foot, {slim, slim}, 0.5 * radius_m, lower, surfaces);
  AddColumn(Moved(foot, 0, 0, 0.5 * radius_m), {radius_m, radius_m}, 0.9 * radius_m, lower,
            surfaces);
  AddColumn(Moved(foot, 0, 0.02, 1.3 * radius_m), {0.9 * radius_m, radius_m}, 0.6 * radius_m, upper,
            surfaces);
}

// From a joint downwards: an upper and a lower part, bent by `bend_rad`.
void AddLimb(const Isometry3d& joint, double length_m, double radius_m, double bend_rad,
             const Material& upper, const Material& lower, std::vector<Surface>* surfaces) {
  const double half = length_m / 2;
  AddColumn(Moved(joint, 0, 0, -half), {radius_m, radius_m}, half, upper, surfaces);
  const Isometry3d knee = Swung(Moved(joint, 0, 0, -half), bend_rad);
  AddColumn(Moved(knee, 0, 0, -half), {0.8 * radius_m, 0.8 * radius_m}, half, lower, surfaces);
}

}  // namespace

Material Tinted(int texture, double low, double high, double saturation, Random* random) {
  const cv::Scalar color = RandomColor(random, low, high, saturation);
  return {texture, Eigen::Vector3d(color[0], color[1], color[2]).cast<float>(), 0.02f};
}

void AddBlock(const Isometry3d& foot, const Vector3d& size, const Material& material,
              std::vector<Surface>* surfaces) {
  const double x = size.x() / 2, y = size.y() / 2, z = size.z();
  const auto face = [&](const Vector3d& o, const Vector3d& r, const Vector3d& d) {
    AddFace(foot, o, r, d, material, surfaces);
  };
  face({-x, -y, z}, {x, -y, z}, {-x, -y, 0});  // front
  face({x, y, z}, {-x, y, z}, {x, y, 0});
  face({-x, y, z}, {-x, -y, z}, {-x, y, 0});
  face({x, -y, z}, {x, y, z}, {x, -y, 0});
  face({-x, y, z}, {x, y, z}, {-x, -y, z});  // top
  face({-x, -y, 0}, {x, -y, 0}, {-x, y, 0});
}

void AddColumn(const Isometry3d& foot, const Vector2d& radii, double height_m,
               const Material& material, std::vector<Surface>* surfaces) {
  const auto corner = [&](int i, double z) {
    const double angle = 2 * M_PI * i / kColumnSides;
    return Vector3d(radii.x() * std::cos(angle), radii.y() * std::sin(angle), z);
  };
  for (int i = 0; i < kColumnSides; ++i) {
    AddFace(foot, corner(i, height_m), corner(i + 1, height_m), corner(i, 0), material, surfaces);
  }
  const Vector2d cap = 0.78 * radii;  // a rectangle that leaves slivers
  for (const double z : {0.0, height_m}) {
    AddFace(foot, {-cap.x(), cap.y(), z}, {cap.x(), cap.y(), z}, {-cap.x(), -cap.y(), z}, material,
            surfaces);
  }
}

void AddCone(const Isometry3d& foot, double radius_m, double height_m, const Material& material,
             std::vector<Surface>* surfaces) {
  const double half = M_PI / kConeSides, side = 2 * radius_m * std::sin(half);
  const Vector3d apex(0, 0, height_m);
  for (int i = 0; i < kConeSides; ++i) {
    const Vector3d out(std::cos(2 * half * i), std::sin(2 * half * i), 0);
    const Vector3d right = side / 2 * Vector3d(-out.y(), out.x(), 0);
    const Vector3d down_end = radius_m * std::cos(half) * out - right;
    AddFace(foot, apex - right, apex + right, down_end, material, surfaces);
    surfaces->back().shape = Surface::Shape::kGable;
    surfaces->back().uv = Eigen::Vector2d(i * side, 0).cast<float>();
  }
}

// A third of base area times height.
double ConeVolume(double radius_m, double height_m) {
  const double base = kConeSides / 2.0 * radius_m * radius_m * std::sin(2 * M_PI / kConeSides);
  return base * height_m / 3;
}

void AddPerson(const Isometry3d& foot, double height_m, const Clothes& clothes, Random* random,
               std::vector<Surface>* surfaces) {
  const double h = height_m, stride = random->Uniform(0, 0.45), girth = random->Uniform(0.9, 1.2);
  for (const double side : {-1.0, 1.0}) {
    const Isometry3d hip = Swung(Moved(foot, side * 0.055 * h, 0, 0.5 * h), side * stride);
    AddLimb(hip, 0.5 * h, 0.047 * h * girth, -0.4 * stride, clothes.lower, clothes.lower, surfaces);
    const double swing = random->Chance(0.25) ? -random->Uniform(0.4, 1.2) : -side * stride;
    const Isometry3d shoulder = Swung(Moved(foot, side * 0.125 * h * girth, 0, 0.82 * h), swing);
    AddLimb(shoulder, 0.4 * h, 0.033 * h, -random->Uniform(0, 1.6), clothes.upper, clothes.skin,
            surfaces);
  }
  const Vector2d waist(0.092 * h * girth, 0.06 * h * girth);
  AddColumn(Moved(foot, 0, 0, 0.47 * h), waist, 0.2 * h, clothes.upper, surfaces);
  AddColumn(Moved(foot, 0, 0, 0.64 * h), {0.112 * h * girth, 0.065 * h * girth}, 0.19 * h,
            clothes.upper, surfaces);
  AddColumn(Moved(foot, 0, 0, 0.82 * h), {0.03 * h, 0.03 * h}, 0.06 * h, clothes.skin, surfaces);
  AddBall(Moved(foot, 0, 0, 0.865 * h), 0.062 * h, clothes.skin, clothes.hair, surfaces);
  if (random->Chance(0.3)) {  // a rucksack
    AddBlock(Moved(foot, 0, 0.11 * h, 0.58 * h), {0.17 * h, 0.09 * h, 0.23 * h}, clothes.hair,
             surfaces);
  }
}

void AddCar(const Isometry3d& foot, const Material& paint, const Material& dark,
            std::vector<Surface>* surfaces) {
  AddBlock(Moved(foot, 0, 0, 0.28), {4.3, 1.75, 0.34}, paint, surfaces);
  AddBlock(Moved(foot, 0, 0, 0.62), {4.15, 1.68, 0.22}, paint, surfaces);
  AddBlock(Moved(foot, 0.25, 0, 0.84), {2.5, 1.5, 0.42}, dark, surfaces);
  AddBlock(Moved(foot, 0.3, 0, 1.26), {2.1, 1.42, 0.12}, paint, surfaces);
  for (const double x : {-0.75, 0.2, 1.2}) {  // pillars
    for (const double y : {-0.745, 0.745}) {
      AddBlock(Moved(foot, x, y, 0.84), {0.09, 0.03, 0.42}, paint, surfaces);
    }
  }
  for (const double x : {-1.35, 1.35}) {
    for (const double y : {-0.9, 0.72}) {
      const Isometry3d axle = Swung(Moved(foot, x, y, 0.33), -M_PI / 2);
      AddColumn(axle, {0.33, 0.33}, 0.18, dark, surfaces);
    }
  }
}

void AddMonument(const Isometry3d& foot, const Material& stone, const Material& bronze,
                 Random* random, std::vector<Surface>* surfaces) {
  double z = 0;
  const auto tier = [&](double width, double height) {
    AddBlock(Moved(foot, 0, 0, z), {width, width, height}, stone, surfaces);
    z += height;
  };
  for (const double width : {3.6, 3.0, 2.4}) tier(width, 0.18);
  for (const double width : {1.8, 1.65}) tier(width, 0.15);
  tier(1.35, 1.6);
  for (const double width : {1.6, 1.75, 1.3}) tier(width, 0.11);
  const Clothes clothes{bronze, bronze, bronze, bronze};
  AddPerson(Moved(foot, 0, 0, z), 2.7, clothes, random, surfaces);
  AddColumn(Moved(foot, 0, 0.1, z), {0.42, 0.34}, 1.3, bronze, surfaces);  // a coat
  for (int i = 0; i < 24; ++i) {                                           // its folds, and relief
    const double angle = random->Uniform(0, 2 * M_PI);
    AddColumn(Moved(foot, 0.42 * std::cos(angle), 0.1 + 0.34 * std::sin(angle), z), {0.05, 0.07},
              random->Uniform(0.6, 1.5), bronze, surfaces);
  }
  for (const double x : {-1.4, 1.4}) {  // lamps beside it
    for (const double y : {-1.4, 1.4}) {
      AddColumn(Moved(foot, x, y, 0), {0.08, 0.08}, 1.1, stone, surfaces);
      AddBall(Moved(foot, x, y, 1.1), 0.16, stone, stone, surfaces);
    }
  }
}

}  // namespace skein::sim
