#include "geometry/georeference.h"

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <optional>
#include <random>

#include "base/gps.h"

namespace skein {
namespace {

using Points = std::vector<Eigen::Vector3d>;
using Indices = std::vector<size_t>;

constexpr double kMedianOfChi2 = 2.366;  // of 3 degrees of freedom
constexpr double kCauchySigmas = 2.385;  // 95 % efficiency for normal noise
constexpr int kMaxIterations = 30;
constexpr size_t kNumConcentrated = 10;  // hypotheses that are concentrated to the end

Eigen::Vector3d ToVector(const GeodeticPosition& p) {
  return {p.latitude_deg, p.longitude_deg, p.altitude_m};
}

double Median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

std::string Text(const char* format, double a, double b = 0) {
  char text[200];
  std::snprintf(text, sizeof(text), format, a, b);
  return text;
}

class Fitter {
 public:
  Fitter(Points from, Points to, const GeoreferenceOptions& options)
      : from_(std::move(from)), to_(std::move(to)), options_(options) {}

  // Least trimmed squares over the better half. nullopt if no triple determines a similarity.
  std::optional<Similarity> FitHalf() const {
    std::mt19937_64 random(options_.seed);
    std::vector<std::pair<double, Similarity>> hypotheses;
    for (int trial = 0; trial < options_.num_trials; ++trial) {
      const auto fit = FitTo(Triple(&random));
      if (fit) hypotheses.emplace_back(TrimmedSum(*fit), *fit);
    }
    const auto better = [](const auto& a, const auto& b) { return a.first < b.first; };
    std::sort(hypotheses.begin(), hypotheses.end(), better);
    if (hypotheses.size() > kNumConcentrated) hypotheses.resize(kNumConcentrated);
    for (auto& [sum, fit] : hypotheses) Concentrate(&sum, &fit);
    const auto best = std::min_element(hypotheses.begin(), hypotheses.end(), better);
    if (best == hypotheses.end()) return std::nullopt;
    return best->second;
  }

  // Standard deviation of a position per axis, from the median residual, with Rousseeuw's
  // correction for small samples.
  double RobustSigma(const Similarity& fit) const {
    const double correction = 1.0 + 5.0 / std::max<double>(1.0, from_.size() - 3.0);
    const double sigma = correction * std::sqrt(Median(SquaredResiduals(fit)) / kMedianOfChi2);
    return std::max(sigma, options_.min_sigma_m);
  }

  Similarity Reweight(Similarity fit, double sigma) const {
    for (int i = 0; i < kMaxIterations; ++i) {
      std::vector<double> weights = SquaredResiduals(fit);
      const double scale = kCauchySigmas * sigma;
      for (double& weight : weights) weight = 1.0 / (1.0 + weight / (scale * scale));
      fit = WeightedFit(weights);
    }
    return fit;
  }

  std::vector<double> SquaredResiduals(const Similarity& fit) const {
    std::vector<double> squares(from_.size());
    for (size_t i = 0; i < from_.size(); ++i)
      squares[i] = (fit.Apply(from_[i]) - to_[i]).squaredNorm();
    return squares;
  }

 private:
  Indices Triple(std::mt19937_64* random) const {
    std::uniform_int_distribution<size_t> any(0, from_.size() - 1);
    Indices triple;
    while (triple.size() < 3) {
      const size_t index = any(*random);
      if (std::find(triple.begin(), triple.end(), index) == triple.end()) triple.push_back(index);
    }
    return triple;
  }

  std::optional<Similarity> FitTo(const Indices& indices) const {
    Points from, to;
    for (const size_t i : indices) {
      from.push_back(from_[i]);
      to.push_back(to_[i]);
    }
    return SimilarityFromPoints(from, to);
  }

  Indices BestHalf(const Similarity& fit) const {
    const std::vector<double> squares = SquaredResiduals(fit);
    Indices indices(squares.size());
    std::iota(indices.begin(), indices.end(), size_t{0});
    std::stable_sort(indices.begin(), indices.end(),
                     [&](size_t a, size_t b) { return squares[a] < squares[b]; });
    indices.resize(squares.size() / 2 + 1);
    return indices;
  }

  double TrimmedSum(const Similarity& fit) const {
    std::vector<double> squares = SquaredResiduals(fit);
    const auto end = squares.begin() + static_cast<std::ptrdiff_t>(squares.size() / 2 + 1);
    std::nth_element(squares.begin(), end - 1, squares.end());
    return std::accumulate(squares.begin(), end, 0.0);
  }

  void Concentrate(double* sum, Similarity* fit) const {
    for (int i = 0; i < kMaxIterations; ++i) {
      const auto next = FitTo(BestHalf(*fit));
      if (!next) return;
      const double next_sum = TrimmedSum(*next);
      if (!(next_sum < *sum)) return;
      *sum = next_sum;
      *fit = *next;
    }
  }

  // Umeyama 1991 with weights.
  Similarity WeightedFit(const std::vector<double>& weights) const {
    double total = 0;
    Eigen::Vector3d mean_from = Eigen::Vector3d::Zero(), mean_to = Eigen::Vector3d::Zero();
    for (size_t i = 0; i < weights.size(); ++i) {
      total += weights[i];
      mean_from += weights[i] * from_[i];
      mean_to += weights[i] * to_[i];
    }
    mean_from /= total;
    mean_to /= total;
    double variance = 0;
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
    for (size_t i = 0; i < weights.size(); ++i) {
      const Eigen::Vector3d f = from_[i] - mean_from, t = to_[i] - mean_to;
      covariance += weights[i] * t * f.transpose();
      variance += weights[i] * f.squaredNorm();
    }
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance,
                                                Eigen::ComputeFullU | Eigen::ComputeFullV);
    Eigen::Vector3d sign = Eigen::Vector3d::Ones();
    if (svd.matrixU().determinant() * svd.matrixV().determinant() < 0) sign.z() = -1;
    Similarity fit;
    const Eigen::Matrix3d R = svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
    fit.rotation = Eigen::Quaterniond(R).normalized();
    fit.scale = (R.transpose() * covariance).trace() / variance;
    fit.translation = mean_to - fit.scale * (fit.rotation * mean_from);
    return fit;
  }

  const Points from_, to_;
  const GeoreferenceOptions options_;
};

// What a similarity's parameters are known to, given the spread of the inliers' centres in metres.
void SetSigmas(const Points& centres_m, Georeference* result) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& centre : centres_m) mean += centre / centres_m.size();
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& centre : centres_m) {
    scatter += (centre - mean) * (centre - mean).transpose();
  }
  const Eigen::Vector3d moments =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter).eigenvalues().cwiseMax(0);
  result->scale_sigma = result->sigma_m / std::sqrt(moments.sum());
  result->rotation_sigma_deg = result->sigma_m / std::sqrt(moments[0] + moments[1]) * 180.0 / M_PI;
}

std::string CheckSpread(const Georeference& result, const GeoreferenceOptions& options) {
  if (!(result.scale_sigma <= options.max_scale)) {
    return Text("the photos were taken in one spot, given positions good to %.2g m",
                result.sigma_m);
  }
  if (!(result.rotation_sigma_deg <= options.max_rotation_deg)) {
    return Text("the photos were taken along a line, given positions good to %.2g m",
                result.sigma_m);
  }
  return "";
}

// Which photos agree; their noise.
void Judge(const Points& from, const Points& to, double limit_m, Georeference* result) {
  Points centres_m;
  double sum = 0;
  for (size_t i = 0; i < from.size(); ++i) {
    GeoResidual& residual = result->residuals[i];
    const Eigen::Vector3d enu = result->enu_from_model.Apply(from[i]);
    residual.enu_m = enu - to[i];
    residual.inlier = residual.enu_m.norm() <= limit_m;
    if (!residual.inlier) continue;
    centres_m.push_back(enu);
    sum += residual.enu_m.squaredNorm();
  }
  result->num_inliers = static_cast<int>(centres_m.size());
  if (centres_m.empty()) return;
  // A similarity takes 7 degrees of freedom.
  result->sigma_m = std::sqrt(sum / std::max<double>(1.0, 3.0 * centres_m.size() - 7.0));
  SetSigmas(centres_m, result);
}

}  // namespace

bool IsPlausible(const GeodeticPosition& p) {
  return ToVector(p).allFinite() && std::abs(p.latitude_deg) <= 90 &&
         std::abs(p.longitude_deg) <= 180 && (p.latitude_deg != 0 || p.longitude_deg != 0);
}

Eigen::Vector3d EnuFromGeodetic(const GeodeticPosition& origin, const GeodeticPosition& position) {
  const colmap::GPSTransform transform(colmap::GPSTransform::WGS84);
  // COLMAP measures from the first of the points.
  return transform.EllToENU({ToVector(origin), ToVector(position)}, origin.latitude_deg,
                            origin.longitude_deg)[1];
}

GeodeticPosition EnuOrigin(const std::vector<GeodeticPosition>& positions) {
  Points plausible;
  for (const GeodeticPosition& p : positions) {
    if (IsPlausible(p)) plausible.push_back(ToVector(p));
  }
  if (plausible.empty()) return {};
  // On the earth's axes: longitudes have a seam.
  const colmap::GPSTransform transform(colmap::GPSTransform::WGS84);
  Eigen::Vector3d median;
  const Points xyz = transform.EllToXYZ(plausible);
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (const Eigen::Vector3d& p : xyz) values.push_back(p[axis]);
    median[axis] = Median(values);
  }
  const Eigen::Vector3d origin = transform.XYZToEll({median})[0];
  return {origin[0], origin[1], origin[2]};
}

Georeference EstimateGeoreference(const GeodeticPosition& origin,
                                  const std::vector<GeoPhoto>& photos,
                                  const GeoreferenceOptions& options) {
  Georeference result;
  result.origin = origin;
  Points from, to;
  for (const GeoPhoto& photo : photos) {
    if (!IsPlausible(photo.position) || !photo.centre.allFinite()) continue;
    from.push_back(photo.centre);
    to.push_back(EnuFromGeodetic(origin, photo.position));
    result.residuals.push_back({photo.name, {}, false});
  }
  // With one more than must agree, a wrong one shows.
  const int num_needed = options.min_inliers + 1;
  if (static_cast<int>(from.size()) < num_needed) {
    result.reason = Text("%.0f registered photos carry a position; it takes %.0f",
                         static_cast<double>(from.size()), num_needed);
    return result;
  }
  const Fitter fitter(from, to, options);
  const std::optional<Similarity> start = fitter.FitHalf();
  if (!start) {
    result.reason = "the photos or their positions lie in one spot or on one line";
    return result;
  }
  const double sigma = fitter.RobustSigma(*start);
  result.enu_from_model = fitter.Reweight(*start, sigma);
  Judge(from, to, options.inlier_sigmas * sigma, &result);
  if (result.num_inliers < options.min_inliers ||
      2 * result.num_inliers < static_cast<int>(from.size())) {
    result.reason = Text("only %.0f of %.0f positions agree with the model", result.num_inliers,
                         static_cast<double>(from.size()));
    return result;
  }
  result.reason = CheckSpread(result, options);
  result.ok = result.reason.empty();
  return result;
}

}  // namespace skein
