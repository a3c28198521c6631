#include "clients/export/picture.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "sfm/pose.h"

namespace skein {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kMargin = 0.06;
constexpr double kFrustum = 0.018;  // of the picture's side
const cv::Scalar kColors[] = {{60, 60, 230},  {230, 120, 30}, {60, 170, 40},
                              {180, 60, 180}, {20, 150, 220}, {150, 150, 0}};

struct CameraMark {
  Vector3d center;
  Matrix3d world_from_cam;
  double half_width, half_height;  // at unit distance
  cv::Scalar color;
};

struct Cloud {
  std::vector<Vector3d> points;
  std::vector<cv::Vec3b> colors;
  std::vector<CameraMark> cameras;
};

Cloud Collect(const Reconstruction& model) {
  Cloud cloud;
  for (const auto& [id, point] : model.Points3D()) {
    cloud.points.push_back(point.XYZ());
    cloud.colors.emplace_back(point.Color(2), point.Color(1), point.Color(0));
  }
  std::map<std::string, size_t> agents;
  for (const ImageId id : model.RegImageIds()) {
    const Image& image = model.Image(id);
    const Camera& camera = model.Camera(image.CameraId());
    const std::string agent = image.Name().substr(0, image.Name().find_last_of('/'));
    const size_t index = agents.emplace(agent, agents.size()).first->second;
    const double focal = camera.MeanFocalLength();
    cloud.cameras.push_back({image.ProjectionCenter(),
                             QuaternionToRotationMatrix(image.Qvec()).transpose(),
                             camera.Width() / focal / 2, camera.Height() / focal / 2,
                             kColors[index % std::size(kColors)]});
  }
  return cloud;
}

// Rows: right, forward, up.
Matrix3d Upright(const Cloud& cloud) {
  Vector3d up = Vector3d::Zero();
  for (const CameraMark& camera : cloud.cameras) up -= camera.world_from_cam.col(1);
  if (up.norm() < 1e-9) up = Vector3d::UnitZ();
  up.normalize();
  const Vector3d right = up.unitOrthogonal();
  Matrix3d upright;
  upright << right.transpose(), up.cross(right).transpose(), up.transpose();
  return upright;
}

// The box that holds all cameras and all but the outermost points.
void Bounds(const std::vector<Vector2d>& points, const std::vector<Vector2d>& cameras,
            Vector2d* low, Vector2d* high) {
  for (int axis = 0; axis < 2; ++axis) {
    std::vector<double> values;
    for (const Vector2d& p : points) values.push_back(p[axis]);
    std::sort(values.begin(), values.end());
    const size_t cut = values.size() / 25;
    double a = values.empty() ? 0 : values[cut];
    double b = values.empty() ? 0 : values[values.size() - 1 - cut];
    for (const Vector2d& c : cameras) {
      a = std::min(a, c[axis]);
      b = std::max(b, c[axis]);
    }
    (*low)[axis] = a;
    (*high)[axis] = b;
  }
}

// Parallel projection along the third row of `view`, the farthest points first.
void DrawView(const Cloud& cloud, const Matrix3d& view, cv::Mat3b image) {
  image.setTo(cv::Scalar(250, 250, 250));
  std::vector<Vector2d> points, cameras;
  for (const Vector3d& p : cloud.points) points.push_back((view * p).head<2>());
  for (const CameraMark& c : cloud.cameras) cameras.push_back((view * c.center).head<2>());
  Vector2d low, high;
  Bounds(points, cameras, &low, &high);
  const double side = image.cols * (1 - 2 * kMargin);
  const double scale = side / std::max((high - low).maxCoeff(), 1e-12);
  const auto place = [&](const Vector3d& p) {
    const Vector2d at = ((view * p).head<2>() - (low + high) / 2) * scale;
    const auto limit = [](double v) { return std::clamp(v, -3e4, 3e4); };
    return cv::Point2d(image.cols / 2.0 + limit(at.x()), image.rows / 2.0 - limit(at.y()));
  };
  std::vector<size_t> order(cloud.points.size());
  for (size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::sort(order.begin(), order.end(), [&](size_t a, size_t b) {
    return view.row(2).dot(cloud.points[a]) < view.row(2).dot(cloud.points[b]);
  });
  for (const size_t i : order) {
    cv::circle(image, place(cloud.points[i]), 1, cv::Scalar(cloud.colors[i]), -1);
  }
  for (const CameraMark& camera : cloud.cameras) {
    const double reach = kFrustum * image.cols / scale;
    std::vector<cv::Point> corners;
    for (const auto& [x, y] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}) {
      const Vector3d corner(x * camera.half_width, y * camera.half_height, 1);
      corners.push_back(place(camera.center + reach * (camera.world_from_cam * corner)));
    }
    cv::polylines(image, corners, true, camera.color, 1, cv::LINE_AA);
    for (const cv::Point& corner : corners) {
      cv::line(image, place(camera.center), corner, camera.color, 1, cv::LINE_AA);
    }
  }
}

}  // namespace

cv::Mat3b DrawModel(const Reconstruction& model, int side_px) {
  const Cloud cloud = Collect(model);
  const Matrix3d upright = Upright(cloud);
  cv::Mat3b picture(side_px, 2 * side_px);
  DrawView(cloud, upright, picture.colRange(0, side_px));
  const double tilt = 55 * M_PI / 180;
  const Matrix3d oblique = Eigen::AngleAxisd(-tilt, Vector3d::UnitX()).toRotationMatrix() *
                           Eigen::AngleAxisd(M_PI / 5, Vector3d::UnitZ()).toRotationMatrix() *
                           upright;
  DrawView(cloud, oblique, picture.colRange(side_px, 2 * side_px));
  return picture;
}

}  // namespace skein
