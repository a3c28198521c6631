#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "sfm/camera.h"
#include "sfm/ids.h"
#include "sfm/image.h"
#include "sfm/track.h"

namespace skein {

// A map: cameras, images with keypoints and poses, points with tracks. A keypoint observes a point
// if, and only if, the point's track has it. Ids that are not there throw std::out_of_range, broken
// contracts std::logic_error. Owned by one thread.
class Reconstruction {
 public:
  size_t NumCameras() const { return cameras_.size(); }
  size_t NumImages() const { return images_.size(); }
  size_t NumRegImages() const { return reg_image_ids_.size(); }
  size_t NumPoints3D() const { return points3D_.size(); }

  const class Camera& Camera(CameraId id) const { return cameras_.at(id); }
  class Camera& Camera(CameraId id) {
    return cameras_.at(id);
  }
  const class Image& Image(ImageId id) const { return images_.at(id); }
  class Image& Image(ImageId id) {
    return images_.at(id);
  }
  const class Point3D& Point3D(Point3DId id) const { return points3D_.at(id); }
  class Point3D& Point3D(Point3DId id) {
    return points3D_.at(id);
  }

  const std::unordered_map<CameraId, class Camera>& Cameras() const { return cameras_; }
  const std::unordered_map<ImageId, class Image>& Images() const { return images_; }
  const std::unordered_map<Point3DId, class Point3D>& Points3D() const { return points3D_; }
  // In the order in which they were registered.
  const std::vector<ImageId>& RegImageIds() const { return reg_image_ids_; }
  std::unordered_set<Point3DId> Point3DIds() const;

  bool ExistsCamera(CameraId id) const { return cameras_.count(id) > 0; }
  bool ExistsImage(ImageId id) const { return images_.count(id) > 0; }
  bool ExistsPoint3D(Point3DId id) const { return points3D_.count(id) > 0; }
  bool IsImageRegistered(ImageId id) const { return Image(id).IsRegistered(); }

  // The id is not there yet. The camera has as many parameters as its model.
  void AddCamera(class Camera camera);
  // The id is not there yet; the image is not registered.
  void AddImage(class Image image);
  // The images of the track are there, and its keypoints observe no point.
  Point3DId AddPoint3D(const Eigen::Vector3d& xyz, Track track, const Rgb& color = Rgb::Zero());
  // The keypoint observes no point.
  void AddObservation(Point3DId id, const TrackElement& element);
  // Replaces both by one point at their mean, weighted by track length. Returns its id.
  Point3DId MergePoints3D(Point3DId id1, Point3DId id2);
  void DeletePoint3D(Point3DId id);
  // Deletes the point, too, if it would be left with one observation.
  void DeleteObservation(ImageId image_id, Point2DIdx index);

  void RegisterImage(ImageId id);
  // Deletes its observations.
  void DeRegisterImage(ImageId id);

  // x_new = scale R x + t, for the points and the cameras.
  void Transform(double scale, const Eigen::Matrix3d& R, const Eigen::Vector3d& t);

  size_t ComputeNumObservations() const;
  double ComputeMeanTrackLength() const;        // 0 without points
  double ComputeMeanReprojectionError() const;  // of points with an error; 0 without any

 private:
  void Observe(const TrackElement& element, Point3DId id);

  std::unordered_map<CameraId, class Camera> cameras_;
  std::unordered_map<ImageId, class Image> images_;
  std::unordered_map<Point3DId, class Point3D> points3D_;
  std::vector<ImageId> reg_image_ids_;
  Point3DId num_added_points3D_ = 0;
};

}  // namespace skein
