#include "merging/shared_views.h"

#include "sfm/camera.h"

namespace skein {
namespace {

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

std::vector<SharedView> ViewsOf(const SharedImages& images) {
  std::vector<SharedView> views;
  for (const SharedImage& image : images) {
    if (!ExistsCameraModel(image.camera_model_id)) continue;
    if (!AreParamsOfModel(image.camera_model_id, image.params)) continue;
    views.push_back(ViewOf(image));
  }
  return views;
}

}  // namespace skein
