#include "clients/places/paint.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

namespace skein::sim {
namespace {

cv::Scalar Vary(const cv::Scalar& color, double amount, Random* random) {
  const double common = random->Uniform(-amount, amount);
  cv::Scalar varied;
  for (int c = 0; c < 3; ++c) {
    varied[c] = std::clamp(color[c] * (1 + common + random->Uniform(-0.3, 0.3) * amount), 0., 255.);
  }
  return varied;
}

cv::Point RandomPoint(const cv::Rect& box, Random* random) {
  return {box.x + random->Int(0, std::max(0, box.width - 1)),
          box.y + random->Int(0, std::max(0, box.height - 1))};
}

// Rows of bricks or blocks of varying size; joints stay in the colour below.
void PaintCourses(const cv::Scalar& color, double height_m, double length_m, double irregular,
                  double joint_m, double contrast, Random* random, Sheet* sheet) {
  double y = -random->Uniform(0, height_m);
  while (y < sheet->height_m()) {
    const double row = height_m * (1 + random->Uniform(-irregular, irregular));
    double x = -random->Uniform(0, length_m);
    while (x < sheet->width_m()) {
      const double length = length_m * (1 + random->Uniform(-irregular, irregular));
      const cv::Rect box = sheet->Box(x, y, length - joint_m, row - joint_m);
      if (!box.empty()) cv::rectangle(sheet->image, box, Vary(color, contrast, random), -1);
      x += length;
    }
    y += row;
  }
}

// Patches in which what lies under the plaster shows.
void BlendPatches(const cv::Mat3b& below, double share, Random* random, Sheet* sheet) {
  const cv::Mat1f field =
      Noise(sheet->image.size(), sheet->Px(1.6), std::max(2, sheet->Px(0.02)), 0.55f, random);
  const float limit = static_cast<float>(2.2 - 3.0 * share);
  below.copyTo(sheet->image, field > limit);
  cv::Mat edge;
  cv::morphologyEx(field > limit, edge, cv::MORPH_GRADIENT, cv::Mat());
  sheet->image.setTo(cv::Scalar(70, 75, 80), edge);
}

void PaintBrickBase(Random* random, Sheet* sheet) {
  const bool red = random->Chance(0.6);
  const cv::Scalar brick =
      red ? cv::Scalar(random->Uniform(55, 85), random->Uniform(70, 100), random->Uniform(130, 175))
          : cv::Scalar(random->Uniform(110, 140), random->Uniform(140, 165),
                       random->Uniform(160, 185));
  sheet->image.setTo(RandomColor(random, 140, 190, 0.1));
  PaintCourses(brick, 0.085, 0.26, 0.12, 0.014, 0.32, random, sheet);
}

void PaintPlasterBase(Random* random, Sheet* sheet) {
  sheet->image.setTo(RandomColor(random, 135, 215, 0.35));
  Sheet bricks(sheet->width_m(), sheet->height_m(), sheet->texels_per_m);
  PaintBrickBase(random, &bricks);
  cv::resize(bricks.image, bricks.image, sheet->image.size());
  BlendPatches(bricks.image, random->Uniform(0.1, 0.35), random, sheet);
}

void PaintConcreteBase(Random* random, Sheet* sheet) {
  sheet->image.setTo(cv::Scalar(70, 72, 72));
  const cv::Scalar color = RandomColor(random, 130, 180, 0.08);
  const double panel = random->Uniform(1.0, 1.6);
  PaintCourses(color, panel, panel * random->Uniform(1.2, 2.0), 0.02, 0.02, 0.14, random, sheet);
  for (double y = 0.2; y < sheet->height_m(); y += panel / 2) {
    for (double x = 0.2; x < sheet->width_m(); x += panel / 2) {
      const cv::Point at(sheet->Px(x + random->Uniform(-.02, .02)), sheet->Px(y));
      cv::circle(sheet->image, at, std::max(1, sheet->Px(0.02)), cv::Scalar(60, 60, 60), -1,
                 cv::LINE_AA);
    }
  }
}

void PaintPlanksBase(Random* random, Sheet* sheet) {
  sheet->image.setTo(cv::Scalar(30, 35, 40));
  PaintCourses(RandomColor(random, 80, 170, 0.5), 0.16, 2.4, 0.1, 0.012, 0.3, random, sheet);
  cv::Mat1f grain =
      Noise(cv::Size(sheet->image.cols / 12 + 8, sheet->image.rows), 24, 2, 0.8f, random);
  cv::resize(grain, grain, sheet->image.size());
  Modulate(grain, 0.12f, &sheet->image);
}

void PaintGlass(const cv::Rect& box, Random* random, Sheet* sheet) {
  const cv::Scalar dark = RandomColor(random, 25, 70, 0.3);
  cv::rectangle(sheet->image, box, dark, -1);
  for (int i = 0; i < 4; ++i) {  // what stands behind the pane
    const cv::Point a = RandomPoint(box, random), b = RandomPoint(box, random);
    cv::rectangle(sheet->image, cv::Rect(a, b) & box, Vary(dark, 0.6, random), -1);
  }
  if (random->Chance(0.6)) {
    const cv::Scalar curtain = RandomColor(random, 120, 210, 0.3);
    const double share = random->Uniform(0.15, 0.5);
    for (int x = 0; x < box.width; ++x) {
      const double side = std::min(x, box.width - 1 - x) / static_cast<double>(box.width);
      if (side > share / 2) continue;
      const double fold = 0.75 + 0.25 * std::sin(x * 0.7 + 3 * random->Unit());
      cv::line(sheet->image, {box.x + x, box.y}, {box.x + x, box.y + box.height - 1},
               curtain * fold);
    }
  }
  if (random->Chance(0.3)) {
    const int height = static_cast<int>(box.height * random->Uniform(0.15, 0.7));
    const cv::Scalar blind = RandomColor(random, 130, 220, 0.2);
    for (int y = 0; y < height; ++y) {
      const double slat = y % 5 == 0 ? 0.6 : random->Uniform(0.9, 1.0);
      cv::line(sheet->image, {box.x, box.y + y}, {box.x + box.width - 1, box.y + y}, blind * slat);
    }
  }
}

// A lamp's or a window's light around `lit` (metres), darker towards the sheet's edges.
void ShadeUnevenly(const cv::Point2d& lit, Sheet* sheet) {
  constexpr double kFar = 0.55, kReachM = 3, kCornerM = 0.25;
  for (int y = 0; y < sheet->image.rows; ++y) {
    for (int x = 0; x < sheet->image.cols; ++x) {
      const cv::Point2d at(x / sheet->texels_per_m, y / sheet->texels_per_m);
      const double distance = cv::norm(at - lit) / kReachM;
      const double edge = std::min({at.x, at.y, sheet->width_m() - at.x, sheet->height_m() - at.y});
      const double light = (kFar + (1 - kFar) / (1 + distance * distance)) *
                           (1 - 0.18 * std::exp(-std::max(0.0, edge) / kCornerM));
      for (int c = 0; c < 3; ++c) {
        sheet->image(y, x)[c] = cv::saturate_cast<uchar>(sheet->image(y, x)[c] * light);
      }
    }
  }
}

}  // namespace

cv::Mat1f Noise(cv::Size size, float coarse_px, float fine_px, float persistence, Random* random) {
  cv::Mat1f sum(size, 0.0f);
  float amplitude = 1;
  for (float wave = std::max(coarse_px, fine_px); wave >= fine_px * 0.99f; wave /= 2) {
    if (wave < 1.5f) wave = 1;
    const cv::Size grid(static_cast<int>(size.width / wave) + 3,
                        static_cast<int>(size.height / wave) + 3);
    cv::Mat1f values(grid);
    cv::RNG generator(random->Next());
    generator.fill(values, cv::RNG::NORMAL, 0.0, 1.0);
    cv::Mat1f octave;
    if (wave > 1) {
      const cv::Size whole(cvRound(grid.width * wave), cvRound(grid.height * wave));
      cv::resize(values, octave, whole, 0, 0, cv::INTER_CUBIC);
      octave = octave(cv::Rect(cvRound(wave), cvRound(wave), size.width, size.height));
    } else {
      octave = values(cv::Rect(1, 1, size.width, size.height));
    }
    cv::scaleAdd(octave, amplitude, sum, sum);
    amplitude *= persistence;
  }
  cv::Scalar mean, deviation;
  cv::meanStdDev(sum, mean, deviation);
  return (sum - mean[0]) / std::max(1e-6, deviation[0]);
}

void Modulate(const cv::Mat1f& field, float strength, cv::Mat3b* image) {
  for (int y = 0; y < image->rows; ++y) {
    for (int x = 0; x < image->cols; ++x) {
      const float factor = 1 + strength * field(y, x);
      for (int c = 0; c < 3; ++c) {
        cv::Vec3b& pixel = (*image)(y, x);
        pixel[c] = cv::saturate_cast<uchar>(pixel[c] * factor);
      }
    }
  }
}

cv::Scalar RandomColor(Random* random, double low, double high, double saturation) {
  const double grey = random->Uniform(low, high);
  cv::Scalar color;
  for (int c = 0; c < 3; ++c) {
    color[c] = std::clamp(grey * (1 + saturation * random->Uniform(-1, 1)), 0.0, 255.0);
  }
  return color;
}

void PaintSpeckle(double per_m2, double min_m, double max_m, double contrast, Random* random,
                  Sheet* sheet) {
  const int count = static_cast<int>(per_m2 * sheet->width_m() * sheet->height_m());
  const cv::Rect all({0, 0}, sheet->image.size());
  for (int i = 0; i < count; ++i) {
    const cv::Point at = RandomPoint(all, random);
    const double size = min_m * std::pow(max_m / min_m, std::pow(random->Unit(), 2));
    const cv::Size axes(std::max(1, sheet->Px(size / 2)),
                        std::max(1, sheet->Px(size / 2 * random->Uniform(0.4, 1))));
    const cv::Vec3b here = sheet->image(at);
    const double factor = 1 + contrast * (random->Chance(0.5) ? 1 : -1) * random->Uniform(0.4, 1);
    const cv::Scalar color(std::min(255., here[0] * factor), std::min(255., here[1] * factor),
                           std::min(255., here[2] * factor));
    cv::ellipse(sheet->image, at, axes, random->Uniform(0, 180), 0, 360, color, -1);
  }
}

void PaintCracks(int count, Random* random, Sheet* sheet) {
  for (int i = 0; i < count; ++i) {
    cv::Point2d at = RandomPoint({{0, 0}, sheet->image.size()}, random);
    double heading = random->Uniform(0, 2 * M_PI);
    const int steps = random->Int(10, 40);
    for (int k = 0; k < steps; ++k) {
      heading += random->Gaussian() * 0.5;
      const double step = sheet->texels_per_m * 0.06;
      const cv::Point2d next = at + cv::Point2d(std::cos(heading), std::sin(heading)) * step;
      cv::line(sheet->image, at, next, cv::Scalar(45, 45, 48), random->Chance(0.3) ? 2 : 1,
               cv::LINE_AA);
      at = next;
    }
  }
}

void Mute(double share, Sheet* sheet) {
  cv::Mat grey;
  cv::cvtColor(sheet->image, grey, cv::COLOR_BGR2GRAY);
  cv::cvtColor(grey, grey, cv::COLOR_GRAY2BGR);
  cv::addWeighted(sheet->image, 1 - share, grey, share, 0, sheet->image);
}

void PaintStreaks(const cv::Rect& box, Random* random, Sheet* sheet) {
  for (int x = box.x; x < std::min(box.x + box.width, sheet->image.cols); ++x) {
    const int length = static_cast<int>(box.height * random->Unit() * random->Unit());
    const double strength = random->Uniform(0.05, 0.3);
    for (int y = std::max(0, box.y); y < std::min(box.y + length, sheet->image.rows); ++y) {
      const double fade = 1 - strength * (1 - (y - box.y) / static_cast<double>(length));
      for (int c = 0; c < 3; ++c) {
        sheet->image(y, x)[c] = cv::saturate_cast<uchar>(sheet->image(y, x)[c] * fade);
      }
    }
  }
}

void PaintWindow(const cv::Rect& box, Random* random, Sheet* sheet) {
  if (box.width < 6 || box.height < 6) return;
  PaintGlass(box, random, sheet);
  const cv::Scalar frame =
      random->Chance(0.7) ? RandomColor(random, 190, 240, 0.05) : RandomColor(random, 40, 110, 0.4);
  const int bar = std::max(1, sheet->Px(0.06));
  cv::rectangle(sheet->image, box, frame, 2 * bar);
  const int columns = random->Int(2, 3), rows = random->Int(1, 3);
  for (int i = 1; i < columns; ++i) {
    const int x = box.x + box.width * i / columns;
    cv::line(sheet->image, {x, box.y}, {x, box.y + box.height}, frame, bar);
  }
  for (int i = 1; i < rows; ++i) {
    const int y = box.y + box.height * i / rows;
    cv::line(sheet->image, {box.x, y}, {box.x + box.width, y}, frame, bar);
  }
}

void PaintDoor(const cv::Rect& box, Random* random, Sheet* sheet) {
  const cv::Scalar color = RandomColor(random, 50, 130, 0.5);
  cv::rectangle(sheet->image, box, color, -1);
  const int columns = 2, rows = random->Int(2, 4), gap = std::max(2, sheet->Px(0.08));
  for (int i = 0; i < columns; ++i) {
    for (int j = 0; j < rows; ++j) {
      const cv::Rect panel(box.x + box.width * i / columns + gap,
                           box.y + box.height * j / rows + gap, box.width / columns - 2 * gap,
                           box.height / rows - 2 * gap);
      if (panel.width < 4 || panel.height < 4) continue;
      cv::rectangle(sheet->image, panel, Vary(color, 0.3, random), -1);
      cv::rectangle(sheet->image, panel, Vary(color * 0.6, 0.2, random), 2);
    }
  }
  cv::circle(sheet->image, {box.x + box.width * 9 / 20, box.y + box.height / 2},
             std::max(1, sheet->Px(0.03)), cv::Scalar(120, 200, 220), -1, cv::LINE_AA);
}

void PaintPoster(const cv::Rect& asked, Random* random, Sheet* sheet) {
  const cv::Rect box = asked & cv::Rect({0, 0}, sheet->image.size());
  if (box.width < 8 || box.height < 8) return;
  cv::Mat3b area = sheet->image(box);
  area.setTo(RandomColor(random, 60, 235, 0.7));
  const int shapes = random->Int(6, 14);
  for (int i = 0; i < shapes; ++i) {
    const cv::Rect inside({0, 0}, box.size());
    const cv::Point at = RandomPoint(inside, random);
    const int size = std::max(2, static_cast<int>(box.width * random->Uniform(0.05, 0.3)));
    const cv::Scalar color = RandomColor(random, 20, 235, 0.8);
    if (random->Chance(0.5)) {
      cv::ellipse(area, at, {size, std::max(1, size * random->Int(4, 10) / 10)},
                  random->Uniform(0, 180), 0, 360, color, random->Chance(0.6) ? -1 : 2,
                  cv::LINE_AA);
    } else {
      cv::rectangle(area, cv::Rect(at, cv::Size(size, size)), color, -1);
    }
  }
  const int lines = random->Int(2, 6);
  for (int i = 0; i < lines; ++i) {
    std::string text;
    for (int k = random->Int(3, 12); k > 0; --k)
      text += static_cast<char>('A' + random->Int(0, 25));
    cv::putText(area, text, {box.width / 12, box.height * (i + 1) / (lines + 1)}, random->Int(0, 7),
                box.width / 22.0 / std::sqrt(text.size()) / 3, RandomColor(random, 0, 255, 0.5),
                std::max(1, box.width / 100), cv::LINE_AA);
  }
  cv::rectangle(area, cv::Rect({0, 0}, box.size()), RandomColor(random, 20, 230, 0.4), 2);
}

void PaintGraffiti(const cv::Rect& box, Random* random, Sheet* sheet) {
  const int strokes = random->Int(3, 7);
  const cv::Scalar color = RandomColor(random, 20, 220, 0.9);
  for (int i = 0; i < strokes; ++i) {
    std::vector<cv::Point> stroke;
    cv::Point2d at = RandomPoint(box, random);
    double heading = random->Uniform(0, 2 * M_PI), turn = random->Uniform(-0.4, 0.4);
    for (int k = 0; k < 24; ++k) {
      stroke.push_back(at);
      turn += random->Gaussian() * 0.15;
      heading += turn;
      at += cv::Point2d(std::cos(heading), std::sin(heading)) * (box.height / 14.0);
    }
    cv::polylines(sheet->image, stroke, false, Vary(color, 0.2, random),
                  std::max(2, sheet->Px(random->Uniform(0.03, 0.09))), cv::LINE_AA);
  }
}

void PaintIvy(const cv::Rect& box, Random* random, Sheet* sheet) {
  const cv::Rect area = box & cv::Rect({0, 0}, sheet->image.size());
  const double m2 = area.area() / (sheet->texels_per_m * sheet->texels_per_m);
  const int leaves = static_cast<int>(m2 * 260);
  for (int i = 0; i < leaves; ++i) {
    const double down = 1 - std::pow(random->Unit(), 0.6);  // denser at the bottom
    const double reach = 1 - 0.8 * down;
    const cv::Point at(
        area.x + static_cast<int>(area.width * (0.5 + 0.3 * reach * random->Gaussian() / 1.5)),
        area.y + static_cast<int>(area.height * (1 - down)));
    const int size = std::max(1, sheet->Px(random->Uniform(0.02, 0.06)));
    const cv::Scalar leaf(random->Uniform(15, 60), random->Uniform(50, 150),
                          random->Uniform(25, 90));
    cv::ellipse(sheet->image, at, {size, std::max(1, size * 2 / 3)}, random->Uniform(0, 180), 0,
                360, leaf, -1);
  }
}

void PaintWall(WallKind kind, Random* random, Sheet* sheet) {
  switch (kind) {
    case WallKind::kBrick:
      PaintBrickBase(random, sheet);
      break;
    case WallKind::kStone:
      sheet->image.setTo(RandomColor(random, 90, 130, 0.1));
      PaintCourses(RandomColor(random, 130, 190, 0.2), 0.34, 0.6, 0.4, 0.02, 0.25, random, sheet);
      break;
    case WallKind::kConcrete:
      PaintConcreteBase(random, sheet);
      break;
    case WallKind::kPlanks:
      PaintPlanksBase(random, sheet);
      break;
    default:
      PaintPlasterBase(random, sheet);
  }
  PaintSpeckle(45, 0.02, 0.12, 0.3, random, sheet);
  const cv::Size size = sheet->image.size();
  Modulate(Noise(size, sheet->Px(3), std::max(1.0f, sheet->texels_per_m * 0.012f), 0.72f, random),
           0.13f, &sheet->image);
  PaintCracks(static_cast<int>(sheet->width_m() * sheet->height_m() / 10), random, sheet);
}

void PaintGround(Random* random, Sheet* sheet) {
  sheet->image.setTo(cv::Scalar(95, 98, 100));
  PaintCourses(RandomColor(random, 125, 155, 0.12), 0.5, 0.75, 0.06, 0.025, 0.2, random, sheet);
  Sheet gravel(sheet->width_m(), sheet->height_m(), sheet->texels_per_m);
  gravel.image = cv::Mat3b(sheet->image.size(), cv::Vec3b(105, 115, 125));
  PaintSpeckle(60, 0.03, 0.1, 0.45, random, &gravel);
  BlendPatches(gravel.image, 0.5, random, sheet);
  cv::Mat3b grass(sheet->image.size(), cv::Vec3b(45, 95, 75));
  Modulate(Noise(grass.size(), sheet->Px(0.5), 1, 0.9f, random), 0.3f, &grass);
  BlendPatches(grass, 0.45, random, sheet);
  PaintSpeckle(12, 0.03, 0.25, 0.4, random, sheet);
  PaintCracks(static_cast<int>(sheet->width_m() * sheet->height_m() / 12), random, sheet);
  Modulate(Noise(sheet->image.size(), sheet->Px(5), 1, 0.75f, random), 0.12f, &sheet->image);
}

void PaintFloor(Random* random, Sheet* sheet) {
  sheet->image.setTo(cv::Scalar(60, 60, 62));
  if (random->Chance(0.5)) {
    PaintCourses(RandomColor(random, 100, 170, 0.4), 0.14, 1.3, 0.05, 0.006, 0.25, random, sheet);
  } else {
    PaintCourses(RandomColor(random, 130, 200, 0.2), 0.3, 0.3, 0.0, 0.008, 0.22, random, sheet);
  }
  PaintSpeckle(60, 0.01, 0.08, 0.3, random, sheet);
  Modulate(Noise(sheet->image.size(), sheet->Px(2), 1, 0.75f, random), 0.12f, &sheet->image);
}

void PaintPlain(Random* random, Sheet* sheet) {
  sheet->image.setTo(cv::Scalar(200, 200, 200));
  Modulate(Noise(sheet->image.size(), sheet->Px(1), 2, 0.6f, random), 0.012f, &sheet->image);
}

void PaintCloth(Random* random, Sheet* sheet) {
  sheet->image.setTo(cv::Scalar(200, 200, 200));
  Modulate(Noise(sheet->image.size(), sheet->Px(0.2), 3, 0.5f, random), 0.06f, &sheet->image);
}

void PaintPlainWall(Random* random, Sheet* sheet) {
  sheet->image.setTo(RandomColor(random, 205, 232, 0.025));
  const double w = sheet->width_m(), h = sheet->height_m();
  for (int i = static_cast<int>(w * h / 4); i > 0; --i) {
    const cv::Rect box = sheet->Box(random->Uniform(0, w), h * random->Uniform(0.4, 1),
                                    random->Uniform(0.01, 0.1), random->Uniform(0.004, 0.015));
    if (!box.empty()) sheet->image(box) *= random->Uniform(0.86, 0.97);
  }
  Modulate(Noise(sheet->image.size(), sheet->Px(1.5), 1, 0.6f, random), 0.006f, &sheet->image);
  ShadeUnevenly({w * random->Uniform(0.2, 0.8), h * random->Uniform(0.1, 0.5)}, sheet);
}

void PaintPlainFloor(Random* random, Sheet* sheet) {
  if (random->Chance(0.6)) {
    sheet->image.setTo(cv::Scalar(70, 95, 120));
    PaintCourses(cv::Scalar(95, 130, 160), 0.19, 1.3, 0, 0.004, 0.06, random, sheet);
  } else {
    sheet->image.setTo(RandomColor(random, 90, 140, 0.1));
    Modulate(Noise(sheet->image.size(), sheet->Px(0.05), 1, 0.9f, random), 0.03f, &sheet->image);
  }
  Modulate(Noise(sheet->image.size(), sheet->Px(1), 1, 0.6f, random), 0.02f, &sheet->image);
  ShadeUnevenly({sheet->width_m() / 2, sheet->height_m() / 2}, sheet);
}

void PaintPicture(Random* random, Sheet* sheet) {
  const cv::Size size = sheet->image.size();
  const cv::Scalar above = RandomColor(random, 110, 220, 0.2);
  const cv::Scalar below = RandomColor(random, 50, 150, 0.3);
  const cv::Mat1f field = Noise(size, static_cast<float>(size.width) / 2, 2, 0.55f, random);
  const double horizon = size.height * random->Uniform(0.3, 0.7);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const double depth = (y - horizon) / size.height + 0.07 * field(y, x);
      const cv::Scalar color = (depth < 0 ? above : below) * (1 - 0.5 * std::abs(depth));
      for (int c = 0; c < 3; ++c) sheet->image(y, x)[c] = cv::saturate_cast<uchar>(color[c]);
    }
  }
  Modulate(field, 0.12f, &sheet->image);
  cv::rectangle(sheet->image, cv::Rect({0, 0}, size), cv::Scalar(225, 228, 230), sheet->Px(0.03));
}

void PaintRug(Random* random, Sheet* sheet) {
  sheet->image.setTo(RandomColor(random, 60, 140, 0.25));
  const cv::Scalar line = RandomColor(random, 80, 190, 0.25);
  for (double margin = 0.06; margin < 0.5; margin += random->Uniform(0.08, 0.2)) {
    const cv::Rect box =
        sheet->Box(margin, margin, sheet->width_m() - 2 * margin, sheet->height_m() - 2 * margin);
    cv::rectangle(sheet->image, box, Vary(line, 0.2, random), sheet->Px(0.02));
  }
  Modulate(Noise(sheet->image.size(), sheet->Px(0.1), 1, 0.9f, random), 0.06f, &sheet->image);
}

void PaintTrim(Random* random, Sheet* sheet) {
  sheet->image.setTo(RandomColor(random, 140, 190, 0.1));
  PaintSpeckle(160, 0.01, 0.1, 0.35, random, sheet);
  PaintCracks(static_cast<int>(sheet->width_m() * sheet->height_m()), random, sheet);
  Modulate(Noise(sheet->image.size(), sheet->Px(1), 1, 0.8f, random), 0.15f, &sheet->image);
}

}  // namespace skein::sim
