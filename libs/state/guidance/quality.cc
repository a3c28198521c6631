#include "guidance/quality.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "core/statistics.h"
#include "guidance/live_place.h"
#include "guidance/surfel_views.h"

namespace skein {
namespace {

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
constexpr double kMinCosMatched = 0.34202;  // 70 degrees of incidence
bool CanMatch(double cos_parallax, double cos_incidence) {
  constexpr double kMinCosParallax = 0.5;      // 60 degrees
  constexpr double kMaxCosParallax = 0.99966;  // 1.5 degrees: none at all
  return cos_parallax >= kMinCosParallax && cos_parallax <= kMaxCosParallax &&
         cos_incidence >= kMinCosMatched;
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
double MaxGsd(double target_gsd) { return 4 * target_gsd; }

bool IsGood(double target_gsd, const SurfelQuality& quality) {
  return quality.num_photos >= static_cast<int>(kMinSurfelPhotos) &&
         quality.best_gsd <= target_gsd && quality.reconstructability >= kMinReconstructability &&
         quality.sigma <= kMaxSigmaGsd * target_gsd;
}

}  // namespace

Completeness Summarise(double target_gsd, double max_gsd, const PlaceQuality& place,
                       double hole_share) {
  Completeness result;
  result.hole_share = hole_share;
  result.target_gsd = target_gsd;
  result.max_gsd = max_gsd;
  double good = 0, ground = 0;
  for (const Piece& piece : place.pieces) {
    if (piece.IsGone() || !place.surfels[piece.whole].counts) continue;
    (piece.surfel.is_ground ? ground : result.area) += piece.area;
    if (!piece.surfel.is_ground && piece.quality.good) good += piece.area;
  }
  if (result.area == 0) return result;
  result.ground_share = ground / (ground + result.area);
  result.good_share = good / result.area;
  std::vector<double> sigmas;
  int ends = 0, open = 0;
  for (size_t i = 0; i < place.surfels.size(); ++i) {
    if (!place.Counts(i)) continue;
    ends += place.surface.surfels[i].at_end;
    open += place.surface.surfels[i].open_border;
    sigmas.push_back(place.surfels[i].sigma);
  }
  result.open_share = static_cast<double>(open) / std::max(1, ends);
  if (!sigmas.empty()) result.median_sigma = UpperMedian(std::move(sigmas));
  result.complete = result.GoodOfShown() >= kMinGoodShare && result.open_share <= kMaxOpenShare;
  return result;
}

std::vector<double> GoodSharesOf(const PlaceQuality& place) {
  std::vector<double> good(place.surfels.size(), 0);
  for (const Piece& piece : place.pieces) {
    if (piece.IsGone() || !piece.quality.good) continue;
    good[piece.whole] += piece.area / place.surface.surfels[piece.whole].area;
  }
  return good;
}

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

AssessedViews::AssessedViews(double target_gsd, const Eigen::Vector3d& normal,
                             const std::vector<ViewOfSurfel>& views)
    : target_gsd_(target_gsd), normal_(normal) {
  for (const ViewOfSurfel& view : views) sums_.Count(view);
  std::vector<std::pair<double, size_t>> ranks;
  ranks.reserve(views.size());
  for (size_t i = 0; i < views.size(); ++i) ranks.emplace_back(RankOf(views[i]), i);
  if (ranks.size() > kMaxViews) {
    std::nth_element(ranks.begin(), ranks.begin() + kMaxViews, ranks.end());
    ranks.resize(kMaxViews);
  }
  for (const auto& [rank, i] : ranks) Add(views[i]);
  sums_.sigma = SigmaAlong(normal_, sums_.information);
}

double AssessedViews::RankOf(const ViewOfSurfel& view) const {
  return view.gsd / std::max(0.05, view.direction.dot(normal_));
}

void AssessedViews::Sums::Count(const ViewOfSurfel& view) {
  ++num_photos;
  second_gsd = std::min(second_gsd, std::max(best_gsd, view.gsd));
  best_gsd = std::min(best_gsd, view.gsd);
}

// Adds the pairs of the view with the best ones. Returns whether it matches one; `matches`: of
// these, marks those that do.
bool AssessedViews::AddPairs(const ViewOfSurfel& view, std::array<bool, kMaxViews>* matches,
                             Sums* sums) const {
  static const ParallaxWeights weights;
  const double incidence = view.direction.dot(normal_);
  if (incidence < kMinCosMatched) return false;  // nor does a pair of it count
  bool matches_any = false;
  for (size_t j = 0; j < num_; ++j) {
    const double cos_parallax = view.direction.dot(views_[j].direction);
    const double cos_incidence = std::min(incidence, incidence_[j]);
    if (CanMatch(cos_parallax, cos_incidence)) {
      matches_any = true;
      if (!std::exchange((*matches)[j], true)) sums->information += InformationOf(views_[j]);
    }
    if (cos_incidence < kMinCosIncidence) continue;
    const double resolution =
        1 - std::min(std::max(view.gsd, views_[j].gsd) / MaxGsd(target_gsd_), 1.0);
    sums->reconstructability += weights.Of(cos_parallax) * resolution * cos_incidence;
  }
  if (matches_any) sums->information += InformationOf(view);
  return matches_any;
}

// To the best ones.
void AssessedViews::Add(const ViewOfSurfel& view) {
  matches_[num_] = AddPairs(view, &matches_, &sums_);
  incidence_[num_] = view.direction.dot(normal_);
  views_[num_++] = view;
}

SurfelQuality AssessedViews::QualityOf(const Sums& sums) const {
  SurfelQuality quality;
  quality.num_photos = sums.num_photos;
  quality.best_gsd = sums.num_photos < 2 ? sums.best_gsd : sums.second_gsd;
  quality.reconstructability = sums.reconstructability;
  quality.sigma = sums.sigma;
  quality.good = IsGood(target_gsd_, quality);
  return quality;
}

SurfelQuality AssessedViews::QualityWith(const ViewOfSurfel& view) const {
  Sums sums = sums_;
  sums.Count(view);
  if (num_ < kMaxViews) {
    std::array<bool, kMaxViews> matches = matches_;
    if (AddPairs(view, &matches, &sums)) {
      sums.sigma = SigmaAlong(normal_, sums.information);
    }
    return QualityOf(sums);
  }
  const auto worst =
      std::max_element(views_.begin(), views_.end(),
                       [&](const auto& a, const auto& b) { return RankOf(a) < RankOf(b); });
  if (RankOf(view) < RankOf(*worst)) {
    std::vector<ViewOfSurfel> best(views_.begin(), views_.end());
    best[static_cast<size_t>(worst - views_.begin())] = view;
    const AssessedViews replaced(target_gsd_, normal_, best);
    sums.reconstructability = replaced.sums_.reconstructability;
    sums.sigma = replaced.sums_.sigma;
  }
  return QualityOf(sums);
}

SurfelQuality AssessSurfel(double target_gsd, const Eigen::Vector3d& normal,
                           const std::vector<ViewOfSurfel>& views) {
  return AssessedViews(target_gsd, normal, views).Quality();
}

PlaceQuality AssessPlace(const GuidedMap& map, double target_gsd) {
  LivePlace live({0});
  live.Update(map, target_gsd);
  return live.Take();
}

}  // namespace skein
