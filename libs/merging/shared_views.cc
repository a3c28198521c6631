#include "merging/shared_views.h"

#include "base/camera_models.h"

namespace skein {
namespace {

SharedImage DescribeOne(const colmap::Reconstruction& model, const colmap::Image& image) {
  const colmap::Camera& camera = model.Camera(image.CameraId());
  SharedImage shared;
  shared.image_id = image.ImageId();
  shared.camera_model_id = camera.ModelId();
  shared.params = camera.Params();
  shared.width = camera.Width();
  shared.height = camera.Height();
  for (int i = 0; i < 4; ++i) shared.qvec[i] = image.Qvec()(i);
  for (int i = 0; i < 3; ++i) shared.tvec[i] = image.Tvec()(i);
  for (colmap::point2D_t i = 0; i < image.NumPoints2D(); ++i) {
    const colmap::Point2D& point2D = image.Point2D(i);
    if (!point2D.HasPoint3D()) continue;
    const Eigen::Vector3d& xyz = model.Point3D(point2D.Point3DId()).XYZ();
    shared.points.push_back({i,
                             {xyz.x(), xyz.y(), xyz.z()},
                             static_cast<float>(point2D.X()),
                             static_cast<float>(point2D.Y())});
  }
  return shared;
}

SharedView ViewOf(const SharedImage& image) {
  SharedView view;
  view.image_id = image.image_id;
  view.camera.SetModelId(image.camera_model_id);
  view.camera.SetWidth(image.width);
  view.camera.SetHeight(image.height);
  view.camera.SetParams(image.params);
  view.cam_from_world.rotation =
      Eigen::Quaterniond(image.qvec[0], image.qvec[1], image.qvec[2], image.qvec[3]).normalized();
  view.cam_from_world.translation = {image.tvec[0], image.tvec[1], image.tvec[2]};
  for (const SharedPoint& point : image.points) {
    view.observations[point.point2D_idx] = {{point.xyz[0], point.xyz[1], point.xyz[2]},
                                            {point.u, point.v}};
  }
  return view;
}

}  // namespace

SharedImages DescribeShared(const colmap::Reconstruction& model,
                            const std::vector<int64_t>& image_ids) {
  SharedImages shared;
  for (const int64_t id : image_ids) {
    const auto image_id = static_cast<colmap::image_t>(id);
    if (!model.ExistsImage(image_id) || !model.IsImageRegistered(image_id)) continue;
    shared.push_back(DescribeOne(model, model.Image(image_id)));
  }
  return shared;
}

std::vector<SharedView> ViewsOf(const SharedImages& images) {
  std::vector<SharedView> views;
  for (const SharedImage& image : images) {
    if (!colmap::ExistsCameraModelWithId(image.camera_model_id)) continue;
    if (!colmap::CameraModelVerifyParams(image.camera_model_id, image.params)) continue;
    views.push_back(ViewOf(image));
  }
  return views;
}

}  // namespace skein
