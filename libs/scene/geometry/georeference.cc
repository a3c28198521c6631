#include "geometry/georeference.h"

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdio>
#include <numeric>
#include <optional>
#include <random>

#include "core/angles.h"
#include "core/result.h"
#include "core/statistics.h"
#include "geometry/georeference_refusal.h"

namespace skein {
namespace {

using Photos = std::vector<const GeoPhoto*>;
using Points = std::vector<Eigen::Vector3d>;
using Indices = std::vector<size_t>;

constexpr double kMedianOfChi2[] = {1.386, 2.366};  // of 2 and 3 degrees of freedom
constexpr double kMaxSpreadOfViewsDeg = 20;         // of photos that all look straight down
constexpr double kCauchySigmas = 2.385;             // 95 % efficiency for normal noise
constexpr int kMaxIterations = 30;
constexpr int kMinAgreeing = kMinPositions - 1;  // and half of the photos with a position
constexpr int kNumTriples = 500;                 // tried
constexpr double kMinSigmaM = 0.02;     // positions are not taken for better than this, per axis
constexpr double kMaxRotationDeg = 5;   // standard deviation of the rotation about its worst axis
constexpr double kMaxScaleSigma = 0.1;  // relative standard deviation of the scale
// h, v: the median horizontal and vertical residuals of the fit with altitudes. h0: the median
// horizontal residual of the fit without. t: the tilt between both. Altitudes are left out when
//
//   h0 < kMinHorizontalGain * h, or
//   h0 <= kMaxHorizontalLoss * h and (v > kMaxVerticalRatio * h or t > kMaxTiltDeg).
constexpr double kMinHorizontalGain = 0.7;
constexpr double kMaxHorizontalLoss = 1.25;
constexpr double kMaxVerticalRatio = 4;
constexpr double kMaxTiltDeg = 15;
constexpr size_t kNumConcentrated = 10;  // hypotheses that are concentrated to the end

// Degrees, degrees, metres.
Eigen::Vector3d ToVector(const GeodeticPosition& p, double altitude_m) {
  return {p.latitude_deg, p.longitude_deg, altitude_m};
}

// ECEF in metres on WGS 84.
Eigen::Vector3d EcefFromGeodetic(const Eigen::Vector3d& lat_lon_altitude) {
  constexpr double kEquatorM = 6378137.0, kFlattening = 1.0 / 298.257223563;
  constexpr double kEccentricity2 = kFlattening * (2.0 - kFlattening);
  const double latitude = DegToRad(lat_lon_altitude[0]), longitude = DegToRad(lat_lon_altitude[1]);
  const double altitude_m = lat_lon_altitude[2];
  const double sine = std::sin(latitude);
  const double normal_m = kEquatorM / std::sqrt(1 - kEccentricity2 * sine * sine);
  const double to_axis_m = (normal_m + altitude_m) * std::cos(latitude);
  return {to_axis_m * std::cos(longitude), to_axis_m * std::sin(longitude),
          (normal_m * (1 - kEccentricity2) + altitude_m) * sine};
}

// Rows: east, north and up at a place, in ECEF.
Eigen::Matrix3d EnuAxes(const GeodeticPosition& place) {
  const double latitude = DegToRad(place.latitude_deg), longitude = DegToRad(place.longitude_deg);
  const double sin_lat = std::sin(latitude), cos_lat = std::cos(latitude);
  const double sin_lon = std::sin(longitude), cos_lon = std::cos(longitude);
  Eigen::Matrix3d axes;
  axes << -sin_lon, cos_lon, 0, -sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat, cos_lat * cos_lon,
      cos_lat * sin_lon, sin_lat;
  return axes;
}

std::string Text(const char* format, double a, double b = 0) {
  char text[200];
  std::snprintf(text, sizeof(text), format, a, b);
  return text;
}

// A similarity between corresponding points. `level` is the rotation that makes the model's up the
// third axis. With it only the rotation about that axis is estimated, from the horizontal parts.
class Fitter {
 public:
  Fitter(Points from, Points to, std::optional<Eigen::Quaterniond> level)
      : from_(std::move(from)), to_(std::move(to)), level_(level) {}

  // Least trimmed squares over the better half. nullopt if no sample determines a similarity.
  std::optional<Similarity> FitHalf() const {
    std::mt19937_64 random(1);
    std::vector<std::pair<double, Similarity>> hypotheses;
    for (int trial = 0; trial < kNumTriples; ++trial) {
      const auto fit = FitTo(Sample(&random));
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
    const double sigma =
        correction * std::sqrt(UpperMedian(SquaredResiduals(fit)) / kMedianOfChi2[level_ ? 0 : 1]);
    return std::max(sigma, kMinSigmaM);
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
    for (size_t i = 0; i < from_.size(); ++i) {
      const Eigen::Vector3d residual = fit.Apply(from_[i]) - to_[i];
      squares[i] = level_ ? residual.head<2>().squaredNorm() : residual.squaredNorm();
    }
    return squares;
  }

 private:
  Indices Sample(std::mt19937_64* random) const {
    std::uniform_int_distribution<size_t> any(0, from_.size() - 1);
    Indices sample;
    while (sample.size() < (level_ ? 2u : 3u)) {
      const size_t index = any(*random);
      if (std::find(sample.begin(), sample.end(), index) == sample.end()) sample.push_back(index);
    }
    return sample;
  }

  std::optional<Similarity> FitTo(const Indices& indices) const {
    Points from, to;
    for (const size_t i : indices) {
      from.push_back(from_[i]);
      to.push_back(to_[i]);
    }
    if (!level_) return SimilarityFromPoints(from, to);
    const Similarity fit = LevelFit(from, to, std::vector<double>(from.size(), 1.0));
    if (!std::isfinite(fit.scale) || !(fit.scale > 0)) return std::nullopt;
    return fit;
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

  Similarity WeightedFit(const std::vector<double>& weights) const {
    return level_ ? LevelFit(from_, to_, weights) : FreeFit(weights);
  }

  // In the plane, as complex numbers: to = a * from + b. Leaves the altitude at zero.
  Similarity LevelFit(const Points& from, const Points& to,
                      const std::vector<double>& weights) const {
    using Complex = std::complex<double>;
    double total = 0, variance = 0;
    Complex mean_from = 0, mean_to = 0, covariance = 0;
    std::vector<Complex> f, t;
    for (size_t i = 0; i < from.size(); ++i) {
      const Eigen::Vector3d levelled = *level_ * from[i];
      f.emplace_back(levelled.x(), levelled.y());
      t.emplace_back(to[i].x(), to[i].y());
      total += weights[i];
      mean_from += weights[i] * f[i];
      mean_to += weights[i] * t[i];
    }
    mean_from /= total;
    mean_to /= total;
    for (size_t i = 0; i < from.size(); ++i) {
      covariance += weights[i] * std::conj(f[i] - mean_from) * (t[i] - mean_to);
      variance += weights[i] * std::norm(f[i] - mean_from);
    }
    const Complex a = covariance / variance, b = mean_to - a * mean_from;
    Similarity fit;
    fit.scale = std::abs(a);
    fit.rotation = Eigen::AngleAxisd(std::arg(a), Eigen::Vector3d::UnitZ()) * *level_;
    fit.translation = {b.real(), b.imag(), 0};
    return fit;
  }

  // Umeyama 1991 with weights.
  Similarity FreeFit(const std::vector<double>& weights) const {
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
  const std::optional<Eigen::Quaterniond> level_;
};

Eigen::Quaterniond LevelFromUp(const Eigen::Vector3d& up) {
  return Eigen::Quaterniond::FromTwoVectors(up, Eigen::Vector3d::UnitZ());
}

// Candidates for up in the model's frame, with both signs. One is the direction that the photos'
// horizontal axes avoid (photos held level). The other is the mean view direction, if all views are
// similar (photos straight down).
std::vector<Eigen::Vector3d> UpDirections(const Photos& photos) {
  std::vector<Eigen::Vector3d> ups;
  Eigen::Vector3d view = Eigen::Vector3d::Zero();
  for (int axis = 0; axis < 3; ++axis) {
    Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
    for (const GeoPhoto* photo : photos) {
      const Eigen::Vector3d in_world =
          photo->cam_from_world.rotation.conjugate() * Eigen::Vector3d::Unit(axis);
      scatter += in_world * in_world.transpose();
      if (axis == 2) view += in_world;
    }
    if (axis == 2) continue;
    ups.push_back(Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter).eigenvectors().col(0));
  }
  const double length = view.norm() / static_cast<double>(photos.size());
  if (length > std::cos(DegToRad(kMaxSpreadOfViewsDeg))) ups.push_back(view.normalized());
  const size_t count = ups.size();
  for (size_t i = 0; i < count; ++i) ups.push_back(-ups[i]);
  return ups;
}

// Standard deviations of a similarity's parameters from the spread of the inliers' centres in
// metres.
void SetSigmas(const Points& centres_m, Georeference* result) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& centre : centres_m) mean += centre / centres_m.size();
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& centre : centres_m) {
    scatter += (centre - mean) * (centre - mean).transpose();
  }
  const Eigen::Vector3d moments =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter).eigenvalues().cwiseMax(0);
  const double sigma_m = std::max(result->sigma_m, kMinSigmaM);
  result->scale_sigma = sigma_m / std::sqrt(moments.sum());
  result->rotation_sigma_deg = RadToDeg(sigma_m / std::sqrt(moments[0] + moments[1]));
}

Status CheckSpread(const Georeference& result) {
  if (!(result.scale_sigma <= kMaxScaleSigma)) {
    return FailedPrecondition(
        Text("the photos were taken in one spot, given positions good to %.2g m; walk around, "
             "more than ten times that",
             result.sigma_m));
  }
  if (!(result.rotation_sigma_deg <= kMaxRotationDeg)) {
    return FailedPrecondition(
        Text("the photos were taken along a line, given positions good to %.2g m; walk to its "
             "sides too, more than ten times that",
             result.sigma_m));
  }
  return Status::Ok();
}

// 99 % of the residuals, of three dimensions or of two.
double InlierLimit(double sigma_m, bool in_space) {
  return sigma_m * kInlierSigmas[in_space ? 1 : 0];
}

// Which photos agree; their noise.
void Judge(const Points& from, const Points& to, double sigma_m, Georeference* result) {
  Points centres_m;
  double sum = 0, num_values = 0;
  for (size_t i = 0; i < from.size(); ++i) {
    GeoResidual& residual = result->residuals[i];
    const Eigen::Vector3d enu = result->enu_from_model.Apply(from[i]);
    residual.enu_m = enu - to[i];
    if (!residual.has_altitude) residual.enu_m.z() = 0;
    const bool in_space = result->altitudes_used && residual.has_altitude;
    const double squared =
        in_space ? residual.enu_m.squaredNorm() : residual.enu_m.head<2>().squaredNorm();
    const double limit_m = InlierLimit(sigma_m, in_space);
    residual.inlier = squared <= limit_m * limit_m;
    if (!residual.inlier) continue;
    centres_m.push_back(enu);
    sum += squared;
    num_values += in_space ? 3 : 2;
  }
  result->num_inliers = static_cast<int>(centres_m.size());
  if (centres_m.empty()) return;
  const double num_parameters = result->altitudes_used ? 7 : 4;
  result->sigma_m = std::sqrt(sum / std::max(1.0, num_values - num_parameters));
  SetSigmas(centres_m, result);
}

// One way to georeference, and its median residuals.
struct Attempt {
  Georeference result;
  double horizontal_m = HUGE_VAL;
  double vertical_m = HUGE_VAL;
};

double TiltDeg(const Similarity& a, const Similarity& b) {
  const Eigen::Vector3d up = a.rotation * (b.rotation.conjugate() * Eigen::Vector3d::UnitZ());
  return RadToDeg(std::acos(std::clamp(up.z(), -1.0, 1.0)));
}

bool AltitudesAreBad(const Attempt& with, const Attempt& without) {
  const double ratio = without.horizontal_m / std::max(with.horizontal_m, kMinSigmaM);
  if (ratio < kMinHorizontalGain) return true;
  if (ratio > kMaxHorizontalLoss) return false;
  return with.vertical_m > kMaxVerticalRatio * with.horizontal_m ||
         TiltDeg(with.result.enu_from_model, without.result.enu_from_model) > kMaxTiltDeg;
}

class Estimator {
 public:
  Estimator(const GeodeticPosition& origin, const Photos& photos) : origin_(origin) {
    for (const GeoPhoto* photo : photos) {
      from_.push_back(photo->cam_from_world.Centre());
      to_.push_back(EnuFromGeodetic(origin, photo->position));
      photos_.push_back({photo->name, {0, 0, 0}, photo->position.altitude_m.has_value(), false});
    }
  }

  int num_altitudes() const {
    return static_cast<int>(std::count_if(photos_.begin(), photos_.end(), HasAltitude));
  }

  Georeference Refuse(const std::string& reason) const {
    Georeference refused;
    refused.origin = origin_;
    refused.reason = reason;
    refused.residuals = photos_;
    return refused;
  }

  // With the altitudes, or with the level alone.
  Attempt Try(const std::optional<Eigen::Quaterniond>& level) const {
    Attempt attempt;
    Georeference& result = attempt.result;
    result.origin = origin_;
    result.altitudes_used = !level;
    result.residuals = photos_;
    const Fitter fitter(level ? from_ : WithAltitude(from_), level ? to_ : WithAltitude(to_),
                        level);
    const std::optional<Similarity> start = fitter.FitHalf();
    if (!start) {
      result.reason =
          "the photos or their positions lie in one spot or on one line; walk around, not only "
          "there and back";
      return attempt;
    }
    const double sigma = fitter.RobustSigma(*start);
    result.enu_from_model = fitter.Reweight(*start, sigma);
    if (level) SetAltitude(&result.enu_from_model);
    Judge(from_, to_, sigma, &result);
    const Status status = Check(result);
    result.ok = status.ok();
    result.reason = status.error();
    std::vector<double> horizontal, vertical;
    for (const GeoResidual& residual : result.residuals) {
      horizontal.push_back(residual.enu_m.head<2>().norm());
      if (residual.has_altitude) vertical.push_back(std::abs(residual.enu_m.z()));
    }
    attempt.horizontal_m = UpperMedian(horizontal);
    if (!vertical.empty()) attempt.vertical_m = UpperMedian(vertical);
    return attempt;
  }

 private:
  static bool HasAltitude(const GeoResidual& photo) { return photo.has_altitude; }

  Points WithAltitude(const Points& points) const {
    Points chosen;
    for (size_t i = 0; i < points.size(); ++i) {
      if (photos_[i].has_altitude) chosen.push_back(points[i]);
    }
    return chosen;
  }

  // By the altitudes; without any, the median camera is at 0.
  void SetAltitude(Similarity* fit) const {
    const bool by_altitudes = num_altitudes() > 0;
    std::vector<double> heights;
    for (size_t i = 0; i < from_.size(); ++i) {
      if (by_altitudes && !photos_[i].has_altitude) continue;
      heights.push_back((by_altitudes ? to_[i].z() : 0) - fit->Apply(from_[i]).z());
    }
    fit->translation.z() += UpperMedian(heights);
  }

  Status Check(const Georeference& result) const {
    if (result.num_inliers < kMinAgreeing ||
        2 * result.num_inliers < static_cast<int>(from_.size())) {
      return FailedPrecondition(
          Text("only %.0f of %.0f positions agree with the model; check the "
               "camera's clock and that it waits for GPS",
               result.num_inliers, static_cast<double>(from_.size())));
    }
    return CheckSpread(result);
  }

  const GeodeticPosition origin_;
  Points from_, to_;
  std::vector<GeoResidual> photos_;  // not yet judged
};

bool HasEnough(const Photos& usable) { return static_cast<int>(usable.size()) >= kMinPositions; }

// `usable`: photos with plausible positions. The reason of a refusal is that of the first attempt.
Georeference Estimate(const GeodeticPosition& origin, const Photos& usable) {
  const Estimator estimator(origin, usable);
  if (!HasEnough(usable)) {
    return estimator.Refuse(Text("%.0f registered photos carry a position; it takes %.0f",
                                 static_cast<double>(usable.size()), kMinPositions));
  }
  Attempt with_altitudes;
  const bool has_altitudes = estimator.num_altitudes() >= kMinPositions;
  if (has_altitudes) with_altitudes = estimator.Try(std::nullopt);
  Attempt level;
  for (const Eigen::Vector3d& up : UpDirections(usable)) {
    Attempt attempt = estimator.Try(LevelFromUp(up));
    if (!has_altitudes && !attempt.result.ok && with_altitudes.result.reason.empty()) {
      with_altitudes.result = attempt.result;
    }
    if (attempt.result.ok && attempt.horizontal_m < level.horizontal_m) level = std::move(attempt);
  }
  const bool take_level =
      level.result.ok && (!with_altitudes.result.ok || AltitudesAreBad(with_altitudes, level));
  return take_level ? level.result : with_altitudes.result;
}

}  // namespace

bool IsPlausible(const GeodeticPosition& p) {
  return ToVector(p, p.altitude_m.value_or(0)).allFinite() && std::abs(p.latitude_deg) <= 90 &&
         std::abs(p.longitude_deg) <= 180 && (p.latitude_deg != 0 || p.longitude_deg != 0);
}

Eigen::Vector3d EnuFromGeodetic(const GeodeticPosition& origin, const GeodeticPosition& position) {
  const double base_m = origin.altitude_m.value_or(0);
  const Eigen::Vector3d from = EcefFromGeodetic(ToVector(origin, base_m));
  const Eigen::Vector3d to =
      EcefFromGeodetic(ToVector(position, position.altitude_m.value_or(base_m)));
  return EnuAxes(origin) * (to - from);
}

GeodeticPosition EnuOrigin(const std::vector<GeodeticPosition>& positions) {
  std::vector<GeodeticPosition> plausible;
  Points on_ellipsoid;
  std::vector<double> altitudes;
  for (const GeodeticPosition& p : positions) {
    if (!IsPlausible(p)) continue;
    plausible.push_back(p);
    on_ellipsoid.push_back(ToVector(p, 0));
    if (p.altitude_m) altitudes.push_back(*p.altitude_m);
  }
  if (plausible.empty()) return {};
  // On the earth's axes: longitudes have a seam.
  Points xyz;
  for (const Eigen::Vector3d& p : on_ellipsoid) xyz.push_back(EcefFromGeodetic(p));
  Eigen::Vector3d median;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (const Eigen::Vector3d& p : xyz) values.push_back(p[axis]);
    median[axis] = UpperMedian(values);
  }
  const auto nearest = std::min_element(xyz.begin(), xyz.end(), [&](const auto& a, const auto& b) {
    return (a - median).squaredNorm() < (b - median).squaredNorm();
  });
  GeodeticPosition origin = plausible[static_cast<size_t>(nearest - xyz.begin())];
  origin.altitude_m = altitudes.empty() ? std::nullopt : std::optional(UpperMedian(altitudes));
  return origin;
}

Georeference EstimateGeoreference(const GeodeticPosition& origin,
                                  const std::vector<GeoPhoto>& photos) {
  Photos usable;
  for (const GeoPhoto& photo : photos) {
    const bool finite = photo.cam_from_world.Centre().allFinite();
    if (finite && IsPlausible(photo.position)) usable.push_back(&photo);
  }
  Georeference result = Estimate(origin, usable);
  if (!result.ok && HasEnough(usable)) result.reason = CauseOfRefusal(result, usable, Estimate);
  return result;
}

}  // namespace skein
