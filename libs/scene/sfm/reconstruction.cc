#include "sfm/reconstruction.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <stdexcept>
#include <utility>

#include "sfm/pose.h"

namespace skein {
namespace {

// cam_from_new = s cam_from_old old_from_new, as the camera's frame grows with the world.
void TransformPose(const Eigen::Affine3d& new_from_old, double scale, Image* image) {
  Eigen::Matrix4d pose = Eigen::Matrix4d::Identity();
  pose.topLeftCorner<3, 4>() = image->ProjectionMatrix();
  pose = pose * new_from_old.inverse().matrix();
  pose *= scale;
  image->SetQvec(RotationMatrixToQuaternion(pose.block<3, 3>(0, 0)));
  image->SetTvec(pose.block<3, 1>(0, 3));
}

Track Joined(const Track& a, const Track& b) {
  Track joined;
  joined.Reserve(a.Length() + b.Length());
  joined.AddElements(a.Elements());
  joined.AddElements(b.Elements());
  return joined;
}

}  // namespace

std::unordered_set<Point3DId> Reconstruction::Point3DIds() const {
  std::unordered_set<Point3DId> ids;
  ids.reserve(points3D_.size());
  for (const auto& [id, point] : points3D_) ids.insert(id);
  return ids;
}

void Reconstruction::AddCamera(class Camera camera) {
  if (!camera.VerifyParams()) throw std::logic_error("a camera with parameters of another model");
  const CameraId id = camera.CameraId();
  if (!cameras_.emplace(id, std::move(camera)).second) throw std::logic_error("a camera twice");
}

void Reconstruction::AddImage(class Image image) {
  const ImageId id = image.ImageId();
  if (!images_.emplace(id, std::move(image)).second) throw std::logic_error("an image twice");
}

void Reconstruction::Observe(const TrackElement& element, Point3DId id) {
  class Image& image = Image(element.image_id);
  if (image.Point2D(element.point2D_idx).HasPoint3D()) {
    throw std::logic_error("a keypoint that observes two points");
  }
  image.SetPoint3DForPoint2D(element.point2D_idx, id);
}

Point3DId Reconstruction::AddPoint3D(const Eigen::Vector3d& xyz, Track track, const Rgb& color) {
  const Point3DId id = ++num_added_points3D_;
  for (const TrackElement& element : track.Elements()) Observe(element, id);
  class Point3D& point = points3D_[id];
  point.SetXYZ(xyz);
  point.SetTrack(std::move(track));
  point.SetColor(color);
  return id;
}

void Reconstruction::AddObservation(Point3DId id, const TrackElement& element) {
  class Point3D& point = Point3D(id);
  Observe(element, id);
  point.Track().AddElement(element);
}

Point3DId Reconstruction::MergePoints3D(Point3DId id1, Point3DId id2) {
  const class Point3D& point1 = Point3D(id1);
  const class Point3D& point2 = Point3D(id2);
  const double n1 = static_cast<double>(point1.Track().Length());
  const double n2 = static_cast<double>(point2.Track().Length());
  const Eigen::Vector3d xyz = (n1 * point1.XYZ() + n2 * point2.XYZ()) / (n1 + n2);
  const Eigen::Vector3d color =
      (n1 * point1.Color().cast<double>() + n2 * point2.Color().cast<double>()) / (n1 + n2);
  Track track = Joined(point1.Track(), point2.Track());
  DeletePoint3D(id1);
  DeletePoint3D(id2);
  return AddPoint3D(xyz, std::move(track), color.cast<uint8_t>());
}

void Reconstruction::DeletePoint3D(Point3DId id) {
  for (const TrackElement& element : Point3D(id).Track().Elements()) {
    Image(element.image_id).ResetPoint3DForPoint2D(element.point2D_idx);
  }
  points3D_.erase(id);
}

void Reconstruction::DeleteObservation(ImageId image_id, Point2DIdx index) {
  class Image& image = Image(image_id);
  const Point3DId id = image.Point2D(index).Point3DId();
  Track& track = Point3D(id).Track();
  if (track.Length() <= 2) return DeletePoint3D(id);
  track.DeleteElement(image_id, index);
  image.ResetPoint3DForPoint2D(index);
}

void Reconstruction::RegisterImage(ImageId id) {
  class Image& image = Image(id);
  if (image.IsRegistered()) return;
  image.SetRegistered(true);
  reg_image_ids_.push_back(id);
}

void Reconstruction::DeRegisterImage(ImageId id) {
  class Image& image = Image(id);
  for (Point2DIdx i = 0; i < image.NumPoints2D(); ++i) {
    if (image.Point2D(i).HasPoint3D()) DeleteObservation(id, i);
  }
  image.SetRegistered(false);
  reg_image_ids_.erase(std::remove(reg_image_ids_.begin(), reg_image_ids_.end(), id),
                       reg_image_ids_.end());
}

void Reconstruction::Transform(double scale, const Eigen::Matrix3d& R, const Eigen::Vector3d& t) {
  Eigen::Affine3d new_from_old = Eigen::Affine3d::Identity();
  new_from_old.linear() = scale * R;
  new_from_old.translation() = t;
  for (auto& [id, image] : images_) TransformPose(new_from_old, scale, &image);
  for (auto& [id, point] : points3D_) point.XYZ() = new_from_old * point.XYZ();
}

size_t Reconstruction::ComputeNumObservations() const {
  size_t sum = 0;
  for (const ImageId id : reg_image_ids_) sum += Image(id).NumPoints3D();
  return sum;
}

double Reconstruction::ComputeMeanTrackLength() const {
  if (points3D_.empty()) return 0;
  return static_cast<double>(ComputeNumObservations()) / static_cast<double>(points3D_.size());
}

double Reconstruction::ComputeMeanReprojectionError() const {
  double sum = 0;
  size_t count = 0;
  for (const auto& [id, point] : points3D_) {
    if (!point.HasError()) continue;
    sum += point.Error();
    ++count;
  }
  return count > 0 ? sum / static_cast<double>(count) : 0;
}

}  // namespace skein
