#include "map/shared_images.h"

#include "map/image_pose.h"

namespace skein {
namespace {

SharedImage DescribeOne(const Reconstruction& model, const Image& image) {
  const Camera& camera = model.Camera(image.CameraId());
  SharedImage shared;
  shared.image_id = image.ImageId();
  shared.camera_model_id = camera.ModelId();
  shared.params = camera.Params();
  shared.width = camera.Width();
  shared.height = camera.Height();
  for (int i = 0; i < 4; ++i) shared.qvec[i] = image.Qvec()(i);
  for (int i = 0; i < 3; ++i) shared.tvec[i] = image.Tvec()(i);
  for (Point2DIdx i = 0; i < image.NumPoints2D(); ++i) {
    const Point2D& point2D = image.Point2D(i);
    if (!point2D.HasPoint3D()) continue;
    const Eigen::Vector3d& xyz = model.Point3D(point2D.Point3DId()).XYZ();
    shared.points.push_back({i,
                             {xyz.x(), xyz.y(), xyz.z()},
                             static_cast<float>(point2D.X()),
                             static_cast<float>(point2D.Y())});
  }
  return shared;
}

}  // namespace

SharedImages SharedImagesOf(const Reconstruction& model, const std::vector<int64_t>& image_ids) {
  SharedImages shared;
  for (const int64_t id : image_ids) {
    const auto image_id = static_cast<ImageId>(id);
    if (!IsRegisteredIn(model, image_id)) continue;
    shared.push_back(DescribeOne(model, model.Image(image_id)));
  }
  return shared;
}

}  // namespace skein
