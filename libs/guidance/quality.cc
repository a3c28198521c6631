#include "guidance/quality.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "core/option_check.h"
#include "guidance/holes.h"
#include "guidance/surfel_views.h"
#include "guidance/textured_share.h"

namespace skein {
namespace {

// More photos of a surfel say little; the cost of pairs is quadratic.
constexpr size_t kMaxViews = 16;

std::vector<ViewOfSurfel> BestViews(const Eigen::Vector3d& normal,
                                    std::vector<ViewOfSurfel> views) {
  if (views.size() <= kMaxViews) return views;
  const auto rank = [&](const ViewOfSurfel& view) {
    return view.gsd / std::max(0.05, view.direction.dot(normal));
  };
  std::nth_element(views.begin(), views.begin() + kMaxViews, views.end(),
                   [&](const auto& a, const auto& b) { return rank(a) < rank(b); });
  views.resize(kMaxViews);
  return views;
}

// What a pair of photos is worth by its parallax: Smith et al. 2018, equation 3, the terms of
// triangulation and matchability. 0 beyond 60 degrees.
double ParallaxWeight(double parallax) {
  constexpr double kPi = 3.14159265358979323846, kMaxParallax = kPi / 3;
  if (parallax > kMaxParallax) return 0;
  const double triangulation = 1 / (1 + std::exp(-32 * (parallax - kPi / 16)));
  const double matchability = 1 - 1 / (1 + std::exp(-8 * (parallax - kPi / 4)));
  return triangulation * matchability;
}

// The same of the parallax' cosine, to 1e-4: from a table, since there are millions of pairs.
class ParallaxWeights {
 public:
  ParallaxWeights() {
    for (int i = 0; i < kSteps + 2; ++i) {
      table_[i] = ParallaxWeight(std::acos(std::min(1.0, kMinCos + i * kStep)));
    }
  }

  double Of(double cosine) const {
    if (cosine < kMinCos) return 0;
    const double at = std::min((cosine - kMinCos) / kStep, double{kSteps});
    const int i = static_cast<int>(at);
    return table_[i] + (at - i) * (table_[i + 1] - table_[i]);
  }

 private:
  static constexpr double kMinCos = 0.5;
  static constexpr int kSteps = 4096;
  static constexpr double kStep = (1 - kMinCos) / kSteps;
  std::array<double, kSteps + 2> table_;
};

// Whether dense matching finds the same place in both: enough parallax, not too different. By the
// cosines of their parallax and of the flatter view's incidence.
bool CanMatch(double cos_parallax, double cos_incidence) {
  constexpr double kMinCosParallax = 0.5;       // 60 degrees
  constexpr double kMaxCosParallax = 0.99966;   // 1.5 degrees: none at all
  constexpr double kMinCosIncidence = 0.34202;  // 70 degrees
  return cos_parallax >= kMinCosParallax && cos_parallax <= kMaxCosParallax &&
         cos_incidence >= kMinCosIncidence;
}

// J'J of a point for 1 px of noise.
Eigen::Matrix3d InformationOf(const ViewOfSurfel& view) {
  return (Eigen::Matrix3d::Identity() - view.direction * view.direction.transpose()) /
         (view.gsd * view.gsd);
}

// sqrt(n' information^-1 n); infinite where it is singular.
double SigmaAlong(const Eigen::Vector3d& normal, const Eigen::Matrix3d& information) {
  const double scale = information.trace();
  if (!(scale > 0)) return std::numeric_limits<double>::infinity();
  const Eigen::LDLT<Eigen::Matrix3d> solver(information / scale);
  if (solver.vectorD().minCoeff() < 1e-9) return std::numeric_limits<double>::infinity();
  return std::sqrt(normal.dot(solver.solve(normal)) / scale);
}

// Beyond this ground sampling distance a photo adds nothing.
double MaxGsd(const QualityOptions& options) { return 4 * options.target_gsd; }

double SecondBestGsd(const std::vector<ViewOfSurfel>& views) {
  double best = std::numeric_limits<double>::infinity(), second = best;
  for (const ViewOfSurfel& view : views) {
    second = std::min(second, std::max(best, view.gsd));
    best = std::min(best, view.gsd);
  }
  return views.size() < 2 ? best : second;
}

bool Counts(const QualityOptions& options, const SurfelQuality& quality) {
  return quality.best_gsd <= options.max_gsd_ratio * options.target_gsd;
}

bool IsGood(const QualityOptions& options, const SurfelQuality& quality) {
  return quality.num_photos >= options.min_photos && quality.best_gsd <= options.target_gsd &&
         quality.reconstructability >= options.min_reconstructability &&
         quality.sigma <= options.max_sigma_gsd * options.target_gsd;
}

Completeness Summarise(const QualityOptions& options, const PlaceQuality& place,
                       double hole_share) {
  Completeness result;
  result.hole_share = hole_share;
  result.target_gsd = options.target_gsd;
  result.max_gsd = options.max_gsd_ratio * options.target_gsd;
  std::vector<double> sigmas;
  double good = 0;
  int counting = 0, ends = 0, open = 0;
  for (size_t i = 0; i < place.surfels.size(); ++i) {
    if (!place.surfels[i].counts) continue;
    const Surfel& surfel = place.surface.surfels[i];
    ++counting;
    result.area += surfel.area;
    good += place.good_shares[i] * surfel.area;
    ends += surfel.at_end;
    open += surfel.open_border;
    sigmas.push_back(place.surfels[i].sigma);
  }
  if (counting == 0) return result;
  result.good_share = good / result.area;
  result.open_share = static_cast<double>(open) / std::max(1, ends);
  std::nth_element(sigmas.begin(), sigmas.begin() + counting / 2, sigmas.end());
  result.median_sigma = sigmas[counting / 2];
  result.complete =
      result.GoodOfShown() >= options.min_good_share && result.open_share <= options.max_open_share;
  return result;
}

// With the target, and max_gsd_ratio of it.
QualityOptions ForPlace(QualityOptions options, double median_gsd) {
  const double usual = 2 * median_gsd;
  if (options.target_gsd == 0) options.target_gsd = usual;
  options.max_gsd_ratio *= std::max(1.0, usual / options.target_gsd);
  return options;
}

// Parts, and the surfels that have none.
std::vector<Piece> PiecesOf(DetailedSurface* detailed) {
  const std::vector<Surfel>& wholes = detailed->surface.surfels;
  std::vector<Piece> pieces;
  std::vector<bool> has_parts(wholes.size(), false);
  for (size_t i = 0; i < detailed->parts.size(); ++i) {
    has_parts[detailed->whole_of[i]] = true;
    pieces.push_back(
        {std::move(detailed->parts[i]), detailed->part_width, detailed->whole_of[i], 0, {}});
  }
  for (uint32_t i = 0; i < wholes.size(); ++i) {
    if (!has_parts[i]) pieces.push_back({wholes[i], detailed->surface.cell, i, 0, {}});
  }
  std::vector<double> sums(wholes.size(), 0);
  for (const Piece& piece : pieces) sums[piece.whole] += piece.surfel.area;
  for (Piece& piece : pieces) {
    piece.area = wholes[piece.whole].area * piece.surfel.area / sums[piece.whole];
  }
  return pieces;
}

std::vector<double> GoodSharesOf(const PlaceQuality& place) {
  std::vector<double> good(place.surfels.size(), 0);
  for (const Piece& piece : place.pieces) {
    if (piece.quality.good) {
      good[piece.whole] += piece.area / place.surface.surfels[piece.whole].area;
    }
  }
  return good;
}

}  // namespace

std::vector<ViewOfSurfel> ViewsOf(const GuidedMap& map, const Surfel& surfel) {
  std::vector<ViewOfSurfel> views;
  for (const uint32_t index : surfel.photos) {
    const GuidedPhoto& photo = map.photos[index];
    views.push_back(ViewFrom(photo.cam_from_world.Centre(), map.cameras[photo.camera].FocalPx(),
                             surfel.position));
  }
  return views;
}

ViewOfSurfel ViewFrom(const Eigen::Vector3d& centre, double focal_px,
                      const Eigen::Vector3d& position) {
  const Eigen::Vector3d ray = centre - position;
  const double distance = ray.norm();
  return {ray / distance, distance / focal_px};
}

Status QualityOptions::Check() const {
  return FirstError({InRange("target_gsd", target_gsd, 0.0, 1e12),
                     InRange("min_photos", min_photos, 2, 100),
                     InRange("min_reconstructability", min_reconstructability, 0.0, 100.0),
                     InRange("max_sigma_gsd", max_sigma_gsd, 0.01, 1000.0),
                     InRange("min_textured_share", min_textured_share, 0.0, 1.0),
                     InRange("max_gsd_ratio", max_gsd_ratio, 0.1, 1000.0),
                     InRange("min_good_share", min_good_share, 0.0, 1.0),
                     InRange("max_open_share", max_open_share, 0.0, 1.0)});
}

SurfelQuality AssessSurfel(const QualityOptions& options, const Eigen::Vector3d& normal,
                           const std::vector<ViewOfSurfel>& all_views) {
  SurfelQuality quality;
  quality.num_photos = static_cast<int>(all_views.size());
  quality.best_gsd = SecondBestGsd(all_views);
  quality.sigma = std::numeric_limits<double>::infinity();
  const std::vector<ViewOfSurfel> views = BestViews(normal, all_views);
  static const ParallaxWeights weights;
  constexpr double kMinCosIncidence = 0.7071067811865476;  // of a pair that counts: 45 degrees
  std::array<double, kMaxViews> incidence;                 // cosines
  std::array<bool, kMaxViews> matches{};
  for (size_t i = 0; i < views.size(); ++i) incidence[i] = views[i].direction.dot(normal);
  for (size_t i = 0; i < views.size(); ++i) {
    for (size_t j = 0; j < i; ++j) {
      const double cos_parallax = views[i].direction.dot(views[j].direction);
      const double cos_incidence = std::min(incidence[i], incidence[j]);
      if (CanMatch(cos_parallax, cos_incidence)) matches[i] = matches[j] = true;
      if (cos_incidence < kMinCosIncidence) continue;
      const double resolution =
          1 - std::min(std::max(views[i].gsd, views[j].gsd) / MaxGsd(options), 1.0);
      quality.reconstructability += weights.Of(cos_parallax) * resolution * cos_incidence;
    }
  }
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  for (size_t i = 0; i < views.size(); ++i) {
    if (matches[i]) information += InformationOf(views[i]);
  }
  quality.sigma = SigmaAlong(normal, information);
  quality.counts = Counts(options, quality);
  quality.good = IsGood(options, quality);
  return quality;
}

PlaceQuality AssessPlace(const SurfaceOptions& surface_options,
                         const QualityOptions& quality_options, const GuidedMap& map) {
  DetailedSurface detailed = MakeSurface(surface_options, map);
  PlaceQuality place;
  place.pieces = PiecesOf(&detailed);
  place.surface = std::move(detailed.surface);
  const QualityOptions options = ForPlace(quality_options, place.surface.median_gsd);
  const auto assess = [&](const Surfel& surfel, double width) {
    SurfelQuality quality = AssessSurfel(options, surfel.normal, ViewsOf(map, surfel));
    quality.textured_share = TexturedShare(map, surfel, width, options.min_photos);
    quality.good = quality.good && HasTexture(options, quality);
    return quality;
  };
  for (const Surfel& surfel : place.surface.surfels) {
    place.surfels.push_back(assess(surfel, place.surface.cell));
  }
  for (Piece& piece : place.pieces) piece.quality = assess(piece.surfel, piece.width);
  place.good_shares = GoodSharesOf(place);
  place.completeness = Summarise(options, place, ShareOfHoles(map));
  return place;
}

}  // namespace skein
