#include "sfm/projection.h"

#include <ceres/jet.h>

#include <array>
#include <cmath>
#include <stdexcept>

#include "sfm/colmap_api.h"

namespace skein {
namespace {

// Points closer to the camera's plane than this count as behind it.
constexpr double kMinDepth = 1e-9;

// d (x/z, y/z) / d point.
Eigen::Matrix<double, 2, 3> PerspectiveJacobian(double u, double v, double inverse_z) {
  Eigen::Matrix<double, 2, 3> J;
  J << inverse_z, 0, -u * inverse_z, 0, inverse_z, -v * inverse_z;
  return J;
}

// f, cx, cy, k: pixel = f * (1 + k r^2) * (u, v) + c.
void SimpleRadial(double f, double cx, double cy, double k, double u, double v,
                  Eigen::Vector2d* pixel, Eigen::Matrix2d* J_uv, IntrinsicsJacobian* J_intrinsics) {
  const double r2 = u * u + v * v;
  const double d = 1.0 + k * r2;
  *pixel << f * d * u + cx, f * d * v + cy;
  const double cross = 2.0 * f * k * u * v;
  *J_uv << f * (d + 2.0 * k * u * u), cross, cross, f * (d + 2.0 * k * v * v);
  if (J_intrinsics != nullptr) {
    J_intrinsics->leftCols<4>() << d * u, 1, 0, f * r2 * u, d * v, 0, 1, f * r2 * v;
  }
}

// fx, fy, cx, cy, k1, k2, p1, p2 (Brown 1966): pixel = f * (d u + 2 p1 u v + p2 (r^2 + 2 u^2)) + c,
// and likewise for v, with d = 1 + k1 r^2 + k2 r^4.
void OpenCv(const std::vector<double>& params, double u, double v, Eigen::Vector2d* pixel,
            Eigen::Matrix2d* J_uv, IntrinsicsJacobian* J_intrinsics) {
  const double fx = params[0], fy = params[1], k1 = params[4], k2 = params[5];
  const double p1 = params[6], p2 = params[7];
  const double uu = u * u, uv = u * v, vv = v * v, r2 = uu + vv;
  const double d = 1.0 + (k1 + k2 * r2) * r2;
  const double slope = 2.0 * (k1 + 2.0 * k2 * r2);  // d' = slope (u, v)
  const double x = d * u + 2.0 * p1 * uv + p2 * (r2 + 2.0 * uu);
  const double y = d * v + 2.0 * p2 * uv + p1 * (r2 + 2.0 * vv);
  *pixel << fx * x + params[2], fy * y + params[3];
  const double cross = slope * uv + 2.0 * (p1 * u + p2 * v);
  *J_uv << fx * (d + slope * uu + 2.0 * p1 * v + 6.0 * p2 * u), fx * cross, fy * cross,
      fy * (d + slope * vv + 2.0 * p2 * u + 6.0 * p1 * v);
  if (J_intrinsics != nullptr) {
    J_intrinsics->leftCols<8>() << x, 0, 1, 0, fx * u * r2, fx * u * r2 * r2, fx * 2.0 * uv,
        fx * (r2 + 2.0 * uu), 0, y, 0, 1, fy * v * r2, fy * v * r2 * r2, fy * (r2 + 2.0 * vv),
        fy * 2.0 * uv;
  }
}

// fx, fy, cx, cy, k1 .. k4 (Kannala and Brandt 2006): pixel = f * s (u, v) + c, with
//   s = t (1 + k1 t^2 + k2 t^4 + k3 t^6 + k4 t^8) / r,  t = atan r;  on the axis s = 1.
void OpenCvFisheye(const std::vector<double>& params, double u, double v, Eigen::Vector2d* pixel,
                   Eigen::Matrix2d* J_uv, IntrinsicsJacobian* J_intrinsics) {
  constexpr double kOnAxis = 1e-8;
  const double fx = params[0], fy = params[1];
  const double r = std::hypot(u, v), t = std::atan(r), t2 = t * t;
  double power = t, distorted = t, slope = 1;  // t^(2i + 1), s r, d (s r) / dt
  std::array<double, 4> powers_over_r;
  for (int i = 0; i < 4; ++i) {
    slope += (2 * i + 3) * params[4 + i] * power * t;
    power *= t2;
    distorted += params[4 + i] * power;
    powers_over_r[i] = r > kOnAxis ? power / r : 0;
  }
  const double s = r > kOnAxis ? distorted / r : 1;
  const double bend = r > kOnAxis ? (slope / (1 + r * r) - s) / (r * r) : 0;  // ds = bend r dr
  *pixel << fx * s * u + params[2], fy * s * v + params[3];
  *J_uv << fx * (s + bend * u * u), fx * bend * u * v, fy * bend * u * v, fy * (s + bend * v * v);
  if (J_intrinsics == nullptr) return;
  J_intrinsics->leftCols<4>() << s * u, 0, 1, 0, 0, s * v, 0, 1;
  for (int i = 0; i < 4; ++i) {
    J_intrinsics->col(4 + i) << fx * powers_over_r[i] * u, fy * powers_over_r[i] * v;
  }
}

template <typename Model>
void ByAutomaticDifferentiation(const std::vector<double>& params, double u, double v,
                                Eigen::Vector2d* pixel, Eigen::Matrix2d* J_uv,
                                IntrinsicsJacobian* J_intrinsics) {
  constexpr int kParams = colmap_api::NumParamsOf<Model>();
  using Jet = ceres::Jet<double, kParams + 2>;
  Jet jet_params[kParams];
  for (int i = 0; i < kParams; ++i) jet_params[i] = Jet(params[i], i + 2);
  Jet x, y;
  colmap_api::ImageFromPlane<Model>(jet_params, Jet(u, 0), Jet(v, 1), &x, &y);
  *pixel << x.a, y.a;
  *J_uv << x.v[0], x.v[1], y.v[0], y.v[1];
  if (J_intrinsics == nullptr) return;
  for (int i = 0; i < kParams; ++i) J_intrinsics->col(i) << x.v[i + 2], y.v[i + 2];
}

void Distort(int model_id, const std::vector<double>& params, double u, double v,
             Eigen::Vector2d* pixel, Eigen::Matrix2d* J_uv, IntrinsicsJacobian* J_intrinsics) {
  switch (model_id) {
    case kSimpleRadial:
      return SimpleRadial(params[0], params[1], params[2], params[3], u, v, pixel, J_uv,
                          J_intrinsics);
    case kSimplePinhole:
      return SimpleRadial(params[0], params[1], params[2], 0.0, u, v, pixel, J_uv, J_intrinsics);
    case kOpenCv:
      return OpenCv(params, u, v, pixel, J_uv, J_intrinsics);
    case kOpenCvFisheye:
      return OpenCvFisheye(params, u, v, pixel, J_uv, J_intrinsics);
#define CAMERA_MODEL_CASE(Model)          \
  case colmap_api::IdOf<colmap::Model>(): \
    return ByAutomaticDifferentiation<colmap::Model>(params, u, v, pixel, J_uv, J_intrinsics);
      CAMERA_MODEL_CASE(PinholeCameraModel)
      CAMERA_MODEL_CASE(RadialCameraModel)
      CAMERA_MODEL_CASE(FullOpenCVCameraModel)
      CAMERA_MODEL_CASE(FOVCameraModel)
      CAMERA_MODEL_CASE(SimpleRadialFisheyeCameraModel)
      CAMERA_MODEL_CASE(RadialFisheyeCameraModel)
      CAMERA_MODEL_CASE(ThinPrismFisheyeCameraModel)
#undef CAMERA_MODEL_CASE
    default:
      throw std::invalid_argument("unknown camera model");
  }
}

}  // namespace

bool ProjectWithJacobians(int model_id, const std::vector<double>& params,
                          const Eigen::Vector3d& point_in_cam, Eigen::Vector2d* pixel,
                          Eigen::Matrix<double, 2, 3>* J_point, IntrinsicsJacobian* J_intrinsics) {
  if (!(point_in_cam.z() > kMinDepth)) return false;
  const double inverse_z = 1.0 / point_in_cam.z();
  const double u = point_in_cam.x() * inverse_z;
  const double v = point_in_cam.y() * inverse_z;
  Eigen::Matrix2d J_uv;
  Distort(model_id, params, u, v, pixel, &J_uv, J_intrinsics);
  *J_point = J_uv * PerspectiveJacobian(u, v, inverse_z);
  return true;
}

bool Project(int model_id, const std::vector<double>& params, const Eigen::Vector3d& point_in_cam,
             Eigen::Vector2d* pixel) {
  if (!(point_in_cam.z() > kMinDepth)) return false;
  const double u = point_in_cam.x() / point_in_cam.z();
  const double v = point_in_cam.y() / point_in_cam.z();
  if (model_id == kSimpleRadial) {
    const double fd = params[0] * (1.0 + params[3] * (u * u + v * v));
    *pixel << fd * u + params[1], fd * v + params[2];
    return true;
  }
  Eigen::Matrix2d J_uv;
  Distort(model_id, params, u, v, pixel, &J_uv, nullptr);
  return true;
}

}  // namespace skein
