#include "merging/merge_checks.h"

#include <cmath>

#include "core/log.h"
#include "sfm/reprojection.h"

namespace skein {
namespace {

// Tolerance of a merge.
constexpr double kMaxErrorGrowth = 1.25;    // of the mean error, as a factor ...
constexpr double kMaxErrorGrowthPx = 0.25;  // ... plus this
constexpr double kMaxLostShare = 0.1;       // of a model's good observations
constexpr double kMaxBehindShare = 0.005;   // of a model's observations

void MeasureOne(const Reconstruction& model, const Observation& observation, double max_error_px,
                Residuals* residuals, double* sum_error_px) {
  if (!model.ExistsImage(observation.first)) return;
  const Image& image = model.Image(observation.first);
  if (!image.IsRegistered()) return;
  const Point2D& point2D = image.Point2D(observation.second);
  if (!point2D.HasPoint3D()) return;
  const Eigen::Vector3d& xyz = model.Point3D(point2D.Point3DId()).XYZ();
  if (!HasPointPositiveDepth(image.ProjectionMatrix(), xyz)) {
    ++residuals->num_behind;
    return;
  }
  const double error_px = std::sqrt(CalculateSquaredReprojectionError(
      point2D.XY(), xyz, image.Qvec(), image.Tvec(), model.Camera(image.CameraId())));
  if (!(error_px <= max_error_px)) return;
  ++residuals->num_good;
  *sum_error_px += error_px;
}

}  // namespace

std::vector<Observation> ObservationsOf(const Reconstruction& model,
                                        const std::set<ImageId>& images) {
  std::vector<Observation> observations;
  for (const ImageId id : model.RegImageIds()) {
    if (!images.empty() && !images.count(id)) continue;
    const Image& image = model.Image(id);
    for (Point2DIdx i = 0; i < image.NumPoints2D(); ++i) {
      if (image.Point2D(i).HasPoint3D()) observations.emplace_back(id, i);
    }
  }
  return observations;
}

Residuals MeasureResiduals(const Reconstruction& model,
                           const std::vector<Observation>& observations, double max_error_px) {
  Residuals residuals;
  residuals.num_observations = static_cast<int>(observations.size());
  double sum_error_px = 0;
  for (const Observation& observation : observations) {
    MeasureOne(model, observation, max_error_px, &residuals, &sum_error_px);
  }
  if (residuals.num_good > 0) residuals.mean_error_px = sum_error_px / residuals.num_good;
  return residuals;
}

Status CompareResiduals(const Residuals& before, const Residuals& after) {
  const double behind_before = before.num_behind / (before.num_observations + 1e-9);
  const double behind_after = after.num_behind / (after.num_observations + 1e-9);
  if (behind_after > behind_before + kMaxBehindShare) {
    return FailedPrecondition(
        fmt::format("{:.1f} % of the points fell behind their cameras (before: {:.1f} %)",
                    100 * behind_after, 100 * behind_before));
  }
  if (after.GoodShare() < before.GoodShare() * (1 - kMaxLostShare)) {
    return FailedPrecondition(
        fmt::format("only {:.1f} % of the observations fit (before: {:.1f} %)",
                    100 * after.GoodShare(), 100 * before.GoodShare()));
  }
  const double limit_px = before.mean_error_px * kMaxErrorGrowth + kMaxErrorGrowthPx;
  if (after.mean_error_px > limit_px) {
    return FailedPrecondition(
        fmt::format("the mean reprojection error grew to {:.2f} px (before: {:.2f} px)",
                    after.mean_error_px, before.mean_error_px));
  }
  return Status::Ok();
}

}  // namespace skein
