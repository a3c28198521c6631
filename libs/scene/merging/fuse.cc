#include "merging/fuse.h"

#include <algorithm>
#include <utility>

#include "geometry/sim3_score.h"
#include "map/image_pose.h"
#include "sfm/model_io.h"
#include "sfm/reprojection.h"

namespace skein {
namespace {

CameraPose PoseOf(const Image& image) {
  const Eigen::Vector4d& q = image.Qvec();
  return {Eigen::Quaterniond(q(0), q(1), q(2), q(3)).normalized(), image.Tvec()};
}

void SetPose(const CameraPose& pose, Image* image) {
  const Eigen::Quaterniond& q = pose.rotation;
  image->SetQvec({q.w(), q.x(), q.y(), q.z()});
  image->SetTvec(pose.translation);
}

SharedPhoto SharedPhotoOf(ImageId id, const Reconstruction& source, const Reconstruction& target) {
  const Image &of_source = source.Image(id), &of_target = target.Image(id);
  SharedPhoto shared{id,
                     source.Camera(of_source.CameraId()),
                     target.Camera(of_target.CameraId()),
                     PoseOf(of_source),
                     PoseOf(of_target),
                     {}};
  const Point2DIdx num_both = std::min(of_source.NumPoints2D(), of_target.NumPoints2D());
  for (Point2DIdx i = 0; i < num_both; ++i) {
    const Point2D &in_source = of_source.Point2D(i), &in_target = of_target.Point2D(i);
    if (!in_source.HasPoint3D() || !in_target.HasPoint3D()) continue;
    shared.points.push_back({i, source.Point3D(in_source.Point3DId()).XYZ(),
                             target.Point3D(in_target.Point3DId()).XYZ(), in_source.XY()});
  }
  return shared;
}

class Fuser {
 public:
  Fuser(const Reconstruction& source, const Similarity& target_from_source,
        const Sim3Options& options, Reconstruction* merged)
      : source_(source),
        target_from_source_(target_from_source),
        options_(options),
        merged_(*merged) {}

  FuseResult Run() {
    result_.status = CheckCompatible();
    if (!result_.status.ok()) return result_;
    const std::map<CameraId, int> target_photos = CountPhotos(merged_);
    SortSharedImages();
    for (const ImageId id : result_.kept_source) merged_.DeRegisterImage(id);
    AddImages();
    FusePoints();
    ReconcileCameras(target_photos);
    return result_;
  }

 private:
  Status CheckCompatible() const {
    for (const ImageId id : source_.RegImageIds()) {
      const Image& image = source_.Image(id);
      if (!source_.ExistsCamera(image.CameraId())) {
        return FailedPrecondition("image " + std::to_string(id) + " of the source has no camera");
      }
      if (merged_.ExistsImage(id) && merged_.Image(id).NumPoints2D() != image.NumPoints2D()) {
        return FailedPrecondition("image " + std::to_string(id) +
                                  " has different numbers of keypoints");
      }
    }
    return Status::Ok();
  }

  static std::map<CameraId, int> CountPhotos(const Reconstruction& model) {
    std::map<CameraId, int> counts;
    for (const ImageId id : model.RegImageIds()) ++counts[model.Image(id).CameraId()];
    return counts;
  }

  // Two poses of one photo agree when the source's points reproject through the target's pose.
  bool Agrees(ImageId id) const {
    const Image& target = merged_.Image(id);
    const Image& image = source_.Image(id);
    int num_points = 0, num_inliers = 0;
    for (Point2DIdx i = 0; i < image.NumPoints2D(); ++i) {
      const Point2D& point2D = image.Point2D(i);
      if (!point2D.HasPoint3D()) continue;
      const Eigen::Vector3d xyz =
          target_from_source_.Apply(source_.Point3D(point2D.Point3DId()).XYZ());
      ++num_points;
      num_inliers += ErrorPx(target, point2D.XY(), xyz) <= LimitPx(target);
    }
    return num_points > 0 && num_inliers >= options_.min_inlier_ratio * num_points;
  }

  double LimitPx(const Image& image) const { return MaxErrorPx(merged_.Camera(image.CameraId())); }

  // With the intrinsics of the model that the photo's pose is from.
  const Camera& CameraOf(const Image& image) const {
    const bool of_source =
        result_.added.count(image.ImageId()) > 0 || result_.kept_source.count(image.ImageId()) > 0;
    return (of_source ? source_ : merged_).Camera(image.CameraId());
  }

  double ErrorPx(const Image& image, const Eigen::Vector2d& pixel,
                 const Eigen::Vector3d& xyz) const {
    return std::sqrt(
        CalculateSquaredReprojectionError(pixel, xyz, image.Qvec(), image.Tvec(), CameraOf(image)));
  }

  void SortSharedImages() {
    const std::set<ImageId> registered = RegisteredIn(merged_);
    for (const ImageId id : RegisteredIn(source_)) {
      if (!registered.count(id)) {
        result_.added.insert(id);
      } else if (Agrees(id)) {
        result_.agreeing.insert(id);
      } else if (source_.Image(id).NumPoints3D() > merged_.Image(id).NumPoints3D()) {
        result_.kept_source.insert(id);
      } else {
        result_.kept_target.insert(id);
      }
    }
  }

  // Comes after the points: until then observations are judged with the intrinsics of their submap.
  // A mean would fit neither submap: poses and points have compensated the errors of their
  // intrinsics.
  void ReconcileCameras(const std::map<CameraId, int>& target_photos) {
    for (const auto& [id, num_source] : CountPhotos(source_)) {
      const auto it = target_photos.find(id);
      const int num_target = it == target_photos.end() ? 0 : it->second;
      // Only photos whose pose the target keeps are of it in the source.
      if (!merged_.ExistsCamera(id)) continue;
      if (num_source > num_target) merged_.Camera(id) = source_.Camera(id);
    }
  }

  void AddImages() {
    std::set<ImageId> ids = result_.added;
    ids.insert(result_.kept_source.begin(), result_.kept_source.end());
    for (const ImageId id : ids) {
      const Image& image = source_.Image(id);
      if (!merged_.ExistsCamera(image.CameraId())) {
        merged_.AddCamera(source_.Camera(image.CameraId()));
      }
      if (!merged_.ExistsImage(id)) merged_.AddImage(WithoutPoints(image));
      merged_.Image(id).SetCameraId(image.CameraId());
      SetPose(TransformPose(target_from_source_, PoseOf(image)), &merged_.Image(id));
      merged_.RegisterImage(id);
    }
  }

  void FusePoints() {
    for (const Point3DId id : AscendingPoints(source_)) FusePoint(source_.Point3D(id));
  }

  void FusePoint(const Point3D& point) {
    Track free;
    std::vector<Point3DId> met;
    int num_common = 0;
    for (const TrackElement& element : point.Track().Elements()) {
      if (result_.kept_target.count(element.image_id)) continue;
      const Point2D& point2D = merged_.Image(element.image_id).Point2D(element.point2D_idx);
      if (!point2D.HasPoint3D()) {
        free.AddElement(element);
        continue;
      }
      ++num_common;
      if (std::find(met.begin(), met.end(), point2D.Point3DId()) == met.end()) {
        met.push_back(point2D.Point3DId());
      }
    }
    const int num_fused = Join(point, free, met);
    result_.num_common_points += static_cast<int>(met.size());
    result_.num_fused_points += num_fused;
    if (num_common == 0 && free.Length() >= 2) ++result_.num_added_points;
  }

  // Makes one point of the source's free observations and of those target points that fit it.
  // Returns how many target points took part.
  int Join(const Point3D& point, const Track& free, const std::vector<Point3DId>& met) {
    const Eigen::Vector3d xyz = target_from_source_.Apply(point.XYZ());
    Point3D joined;
    joined.SetXYZ(xyz);
    joined.SetTrack(free);
    const double own_weight = static_cast<double>(point.Track().Length());
    double weight = own_weight;
    std::vector<Point3DId> fitting;
    for (const Point3DId id : met) {
      const Point3D& other = merged_.Point3D(id);
      const double other_weight = static_cast<double>(other.Track().Length());
      Point3D both = joined;
      both.SetXYZ((weight * joined.XYZ() + other_weight * other.XYZ()) / (weight + other_weight));
      both.Track().AddElements(other.Track().Elements());
      if (!Fits(both)) continue;
      joined = both;
      weight += other_weight;
      fitting.push_back(id);
    }
    if (fitting.empty() && free.Length() < 2) return 0;
    for (const Point3DId id : fitting) merged_.DeletePoint3D(id);
    merged_.AddPoint3D(joined.XYZ(), joined.Track(), point.Color());
    return static_cast<int>(fitting.size());
  }

  bool Fits(const Point3D& point) const {
    for (const TrackElement& element : point.Track().Elements()) {
      const Image& image = merged_.Image(element.image_id);
      const Eigen::Vector2d& pixel = image.Point2D(element.point2D_idx).XY();
      if (!(ErrorPx(image, pixel, point.XYZ()) <= LimitPx(image))) return false;
    }
    return true;
  }

  const Reconstruction& source_;
  const Similarity& target_from_source_;
  const Sim3Options& options_;
  Reconstruction& merged_;
  FuseResult result_;
};

}  // namespace

std::set<ImageId> RegisteredIn(const Reconstruction& model) {
  return {model.RegImageIds().begin(), model.RegImageIds().end()};
}

std::vector<SharedPhoto> SharedPhotosOf(const Reconstruction& source,
                                        const Reconstruction& target) {
  std::vector<SharedPhoto> shared;
  for (const ImageId id : RegisteredIn(source)) {
    if (!IsRegisteredIn(target, id)) continue;
    SharedPhoto photo = SharedPhotoOf(id, source, target);
    const bool is_valid = photo.source_camera.VerifyParams() && photo.target_camera.VerifyParams();
    if (is_valid) shared.push_back(std::move(photo));
  }
  return shared;
}

FuseResult FuseModels(const Reconstruction& source, const Similarity& target_from_source,
                      const Sim3Options& options, Reconstruction* merged) {
  return Fuser(source, target_from_source, options, merged).Run();
}

}  // namespace skein
