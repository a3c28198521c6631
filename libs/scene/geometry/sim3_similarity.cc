#include "geometry/sim3_similarity.h"

#include <Eigen/SVD>

namespace skein {
namespace {

// Second singular value over the first below which points count as lying on a line.
constexpr double kMinPlanarity = 1e-3;

Eigen::Matrix3Xd Columns(const std::vector<Eigen::Vector3d>& points) {
  Eigen::Matrix3Xd columns(3, points.size());
  for (size_t i = 0; i < points.size(); ++i) columns.col(i) = points[i];
  return columns;
}

bool SpansPlane(const Eigen::Matrix3Xd& columns) {
  const Eigen::Matrix3Xd centred = columns.colwise() - columns.rowwise().mean();
  const Eigen::Vector3d values =
      Eigen::JacobiSVD<Eigen::Matrix3d>(centred * centred.transpose()).singularValues();
  return values(0) > 0 && values(1) > kMinPlanarity * kMinPlanarity * values(0);
}

}  // namespace

Similarity Similarity::Inverse() const {
  Similarity inverse;
  inverse.scale = 1.0 / scale;
  inverse.rotation = rotation.conjugate();
  inverse.translation = -inverse.scale * (inverse.rotation * translation);
  return inverse;
}

CameraPose TransformPose(const Similarity& target_from_source, const CameraPose& cam_from_source) {
  const Similarity source_from_target = target_from_source.Inverse();
  CameraPose pose;
  pose.rotation = (cam_from_source.rotation * source_from_target.rotation).normalized();
  pose.translation =
      target_from_source.scale *
      (cam_from_source.rotation * source_from_target.translation + cam_from_source.translation);
  return pose;
}

std::optional<Similarity> SimilarityFromPoints(const std::vector<Eigen::Vector3d>& source,
                                               const std::vector<Eigen::Vector3d>& target) {
  if (source.size() < 3 || source.size() != target.size()) return std::nullopt;
  const Eigen::Matrix3Xd from = Columns(source);
  const Eigen::Matrix3Xd to = Columns(target);
  if (!SpansPlane(from) || !SpansPlane(to)) return std::nullopt;
  const Eigen::Matrix4d matrix = Eigen::umeyama(from, to, true);
  const Eigen::Matrix3d scaled = matrix.topLeftCorner<3, 3>();
  Similarity result;
  result.scale = std::cbrt(scaled.determinant());
  if (!std::isfinite(result.scale) || result.scale <= 0) return std::nullopt;
  result.rotation = Eigen::Quaterniond(scaled / result.scale).normalized();
  result.translation = matrix.topRightCorner<3, 1>();
  return result;
}

}  // namespace skein
