#include "features/extremum_refinement.h"

#include <cmath>
#include <cstdlib>

namespace skein {
namespace {

constexpr int kMaxIterations = 5;

struct Quadratic {
  float value;
  float gx, gy, gs;
  float xx, yy, ss, xy, xs, ys;
};

Quadratic Fit(const DogRows& dog, int layer, int row, int x) {
  const auto at = [&](int ds, int dy, int dx) { return dog.rows[layer + ds][row + dy][x + dx]; };
  Quadratic q{};
  q.value = at(0, 0, 0);
  q.gx = 0.5f * (at(0, 0, 1) - at(0, 0, -1));
  q.gy = 0.5f * (at(0, 1, 0) - at(0, -1, 0));
  q.gs = 0.5f * (at(1, 0, 0) - at(-1, 0, 0));
  q.xx = at(0, 0, 1) + at(0, 0, -1) - 2 * q.value;
  q.yy = at(0, 1, 0) + at(0, -1, 0) - 2 * q.value;
  q.ss = at(1, 0, 0) + at(-1, 0, 0) - 2 * q.value;
  q.xy = 0.25f * (at(0, 1, 1) - at(0, 1, -1) - at(0, -1, 1) + at(0, -1, -1));
  q.xs = 0.25f * (at(1, 0, 1) - at(1, 0, -1) - at(-1, 0, 1) + at(-1, 0, -1));
  q.ys = 0.25f * (at(1, 1, 0) - at(1, -1, 0) - at(-1, 1, 0) + at(-1, -1, 0));
  return q;
}

// -H^-1 g by Cramer's rule.
std::optional<SubpixelStep> ToExtremum(const Quadratic& q) {
  const float a = q.yy * q.ss - q.ys * q.ys;
  const float b = q.xs * q.ys - q.xy * q.ss;
  const float c = q.xy * q.ys - q.xs * q.yy;
  const float determinant = q.xx * a + q.xy * b + q.xs * c;
  if (determinant == 0) return std::nullopt;
  const float d = q.xx * q.ss - q.xs * q.xs;
  const float e = q.xy * q.xs - q.xx * q.ys;
  const float f = q.xx * q.yy - q.xy * q.xy;
  const float scale = -1 / determinant;
  const SubpixelStep step{scale * (a * q.gx + b * q.gy + c * q.gs),
                          scale * (b * q.gx + d * q.gy + e * q.gs),
                          scale * (c * q.gx + e * q.gy + f * q.gs)};
  const bool is_bounded =
      std::abs(step.x) < 100 && std::abs(step.y) < 100 && std::abs(step.s) < 100;
  return is_bounded ? std::optional<SubpixelStep>(step) : std::nullopt;
}

bool IsOnEdge(const Quadratic& q, double threshold) {
  const double trace = double{q.xx} + q.yy;
  const double determinant = double{q.xx} * q.yy - double{q.xy} * q.xy;
  return determinant <= 0 ||
         trace * trace * threshold >= (threshold + 1) * (threshold + 1) * determinant;
}

}  // namespace

std::optional<RefinedExtremum> Refine(const DogRows& dog, const FoundExtremum& found,
                                      double min_contrast, double edge_threshold) {
  int layer = found.layer, dx = 0, dy = 0;
  for (int i = 0; i < kMaxIterations; ++i) {
    const Quadratic q = Fit(dog, layer, dy + kMaxRefinementSteps + 1, found.column + dx);
    const auto step = ToExtremum(q);
    if (!step) return std::nullopt;
    if (std::abs(step->x) < 0.5f && std::abs(step->y) < 0.5f && std::abs(step->s) < 0.5f) {
      const float contrast = q.value + 0.5f * (q.gx * step->x + q.gy * step->y + q.gs * step->s);
      if (std::abs(contrast) < min_contrast || IsOnEdge(q, edge_threshold)) return std::nullopt;
      return RefinedExtremum{dx, dy, layer, *step, contrast};
    }
    dx += static_cast<int>(std::lround(step->x));
    dy += static_cast<int>(std::lround(step->y));
    layer += static_cast<int>(std::lround(step->s));
    if (std::abs(dx) > kMaxRefinementSteps || std::abs(dy) > kMaxRefinementSteps || layer < 1 ||
        layer > kOctaveLayers) {
      return std::nullopt;
    }
  }
  return std::nullopt;
}

}  // namespace skein
