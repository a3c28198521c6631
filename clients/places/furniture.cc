#include "clients/places/furniture.h"

#include <vector>

#include "clients/places/solids.h"

namespace skein::sim {
namespace {

using Eigen::Isometry3d;
using Eigen::Translation3d;
using Eigen::Vector3d;

constexpr double kPrintTexelsPerM = 300;
constexpr double kMachineWidthM = 0.95, kMachineHeightM = 1.85;
constexpr double kTableWidthM = 1.2, kTableDepthM = 0.75, kTableHeightM = 0.72, kTablePitchM = 2;

void PaintPosterSheet(Random* random, Sheet* sheet) {
  PaintPoster({{0, 0}, sheet->image.size()}, random, sheet);
}

// A brand above rows of goods, buttons beside, the flap below.
void PaintMachineFront(Random* random, Sheet* sheet) {
  sheet->image.setTo(RandomColor(random, 40, 110, 0.5));
  PaintPoster(sheet->Box(0.05, 0.04, 0.85, 0.26), random, sheet);
  sheet->image(sheet->Box(0.05, 0.34, 0.66, 1.18)).setTo(cv::Scalar(30, 28, 26));
  for (double y = 0.38; y < 1.4; y += 0.225) {
    for (double x = 0.08; x < 0.65; x += 0.105) {
      PaintPoster(sheet->Box(x, y, 0.08, 0.17), random, sheet);
    }
  }
  PaintPoster(sheet->Box(0.75, 0.5, 0.15, 0.22), random, sheet);
  PaintPoster(sheet->Box(0.75, 0.85, 0.15, 0.4), random, sheet);
  sheet->image(sheet->Box(0.1, 1.6, 0.56, 0.14)).setTo(cv::Scalar(20, 20, 20));
}

// A flat picture, painted by `painter`. `right`, `down`: its edges in the frame of `foot`.
void AddPrint(const Isometry3d& foot, const Vector3d& origin, const Vector3d& right,
              const Vector3d& down, uint64_t seed, const PlaceBuilder::Painter& painter,
              PlaceBuilder* builder) {
  Surface print;
  print.origin = (foot * origin).cast<float>();
  print.right = (foot.linear() * right).cast<float>();
  print.down = (foot.linear() * down).cast<float>();
  print.detail = 0.015f;
  print.texture = builder->AddPainting(right.norm(), down.norm(), kPrintTexelsPerM,
                                       Texture::Edge::kClamp, seed, painter);
  builder->AddSurface(print);
}

void AddChair(const Isometry3d& foot, const Material& cloth, const Material& steel,
              std::vector<Surface>* surfaces) {
  AddBlock(foot * Translation3d(0, 0, 0.43), {0.44, 0.42, 0.05}, cloth, surfaces);
  AddBlock(foot * Translation3d(0, 0.2, 0.52), {0.42, 0.03, 0.38}, cloth, surfaces);
  for (const double x : {-0.19, 0.19}) {
    for (const double y : {-0.18, 0.18}) {
      AddColumn(foot * Translation3d(x, y, 0), {0.015, 0.015}, 0.43, steel, surfaces);
    }
  }
}

// A function of its foot and `random`.
void AddTable(const Isometry3d& foot, Random random, PlaceBuilder* builder) {
  const Material steel{builder->Paint(), {0.3f, 0.3f, 0.3f}, 0.01f};
  const Material cloth = Tinted(builder->RandomTrim(&random), 0.4, 0.9, 0.5, &random);
  const Material wood{builder->Paint(), {0.4f, 0.58f, 0.75f}, 0.02f};
  std::vector<Surface> surfaces;
  AddBlock(foot * Translation3d(0, 0, kTableHeightM - 0.03), {kTableWidthM, kTableDepthM, 0.03},
           wood, &surfaces);
  AddBlock(foot, {0.5, 0.4, 0.03}, steel, &surfaces);
  AddColumn(foot, {0.04, 0.04}, kTableHeightM - 0.03, steel, &surfaces);
  for (int i = 0; i < 6; ++i) {  // cups, boxes and cards
    const Isometry3d at =
        foot * Translation3d(random.Uniform(-0.5, 0.5), random.Uniform(-0.3, 0.3), kTableHeightM);
    const Material print = Tinted(builder->RandomTrim(&random), 0.3, 1.1, 0.4, &random);
    if (i % 2 == 0) {
      AddColumn(at, {0.05, 0.05}, random.Uniform(0.08, 0.2), print, &surfaces);
    } else {
      AddBlock(at, {random.Uniform(0.06, 0.2), 0.08, random.Uniform(0.08, 0.25)}, print, &surfaces);
    }
  }
  AddChair(foot * Translation3d(0, 0.55, 0), cloth, steel, &surfaces);
  const Isometry3d turned = foot * Eigen::AngleAxisd(M_PI, Vector3d::UnitZ());
  AddChair(turned * Translation3d(0, 0.55, 0), cloth, steel, &surfaces);
  builder->AddSurfaces(surfaces);
  AddPrint(foot, {-0.45, 0.3, kTableHeightM + 0.002}, {0.9, 0, 0}, {0, -0.6, 0}, random.Next(),
           PaintPosterSheet, builder);
}

}  // namespace

void AddVendingMachine(const Isometry3d& foot, uint64_t design, PlaceBuilder* builder) {
  constexpr double kPrintM = 0.003;  // before the body
  const double x = kMachineWidthM / 2, y = kVendingMachineDepthM / 2, z = kMachineHeightM;
  Random random(design);
  std::vector<Surface> body;
  AddBlock(foot, {2 * x, 2 * y, z}, Tinted(builder->Paint(), 0.2, 0.7, 0.3, &random), &body);
  builder->AddSurfaces(body);
  const Vector3d down(0, 0, -z);
  AddPrint(foot, {-x, -y - kPrintM, z}, {2 * x, 0, 0}, down, random.Next(), PaintMachineFront,
           builder);
  AddPrint(foot, {-x - kPrintM, y, z}, {0, -2 * y, 0}, down, random.Next(), PaintPosterSheet,
           builder);
  AddPrint(foot, {x + kPrintM, -y, z}, {0, 2 * y, 0}, down, random.Next(), PaintPosterSheet,
           builder);
}

void AddTables(const Isometry3d& middle, int columns, int rows, uint64_t design,
               PlaceBuilder* builder) {
  for (int column = 0; column < columns; ++column) {
    for (int row = 0; row < rows; ++row) {
      const double x = column - (columns - 1) / 2.0, y = row - (rows - 1) / 2.0;
      AddTable(middle * Translation3d(kTablePitchM * x, kTablePitchM * y, 0), Random(design),
               builder);
    }
  }
}

}  // namespace skein::sim
