#include "export/bundler.h"

#include <map>
#include <sstream>
#include <string>

#include "core/file.h"
#include "export/simple_camera.h"
#include "sfm/model_io.h"

namespace skein {
namespace {

void AddCamera(const Camera& camera, const Image& image, std::ostream* text) {
  double distortion[2] = {0, 0};
  for (size_t i = 0; i < camera.ExtraParamsIdxs().size(); ++i) {
    distortion[i] = camera.Params(camera.ExtraParamsIdxs()[i]);
  }
  *text << camera.MeanFocalLength() << " " << distortion[0] << " " << distortion[1] << "\n";
  const Eigen::Matrix3d R = image.RotationMatrix();
  for (int row = 0; row < 3; ++row) {
    const double sign = row == 0 ? 1 : -1;
    *text << sign * R(row, 0) << " " << sign * R(row, 1) << " " << sign * R(row, 2) << "\n";
  }
  const Eigen::Vector3d& t = image.Tvec();
  *text << t.x() << " " << -t.y() << " " << -t.z() << "\n";
}

void AddPoint(const Reconstruction& model, const Point3D& point,
              const std::map<ImageId, size_t>& position, std::ostream* text) {
  *text << point.X() << " " << point.Y() << " " << point.Z() << "\n";
  const Eigen::Vector3i rgb = point.Color().cast<int>();
  *text << rgb[0] << " " << rgb[1] << " " << rgb[2] << "\n" << point.Track().Length();
  for (const TrackElement& element : point.Track().Elements()) {
    const Image& image = model.Image(element.image_id);
    const Camera& camera = model.Camera(image.CameraId());
    const Point2D& keypoint = image.Point2D(element.point2D_idx);
    *text << " " << position.at(element.image_id) << " " << element.point2D_idx << " "
          << keypoint.X() - camera.PrincipalPointX() << " "
          << camera.PrincipalPointY() - keypoint.Y();
  }
  *text << "\n";
}

}  // namespace

Status WriteBundlerFiles(const Reconstruction& model, const std::filesystem::path& file,
                         const std::filesystem::path& list) {
  for (const auto& [id, camera] : model.Cameras()) {
    if (Status simple = ExpectSimpleCamera(camera, "bundler"); !simple.ok()) return simple;
  }
  std::ostringstream text, names;
  text.precision(17);
  text << "# Bundle file v0.3\n" << model.NumRegImages() << " " << model.NumPoints3D() << "\n";
  std::map<ImageId, size_t> position;
  for (const ImageId id : model.RegImageIds()) {
    const Image& image = model.Image(id);
    position.emplace(id, position.size());
    AddCamera(model.Camera(image.CameraId()), image, &text);
    names << image.Name() << "\n";
  }
  for (const Point3DId id : AscendingPoints(model)) {
    AddPoint(model, model.Point3D(id), position, &text);
  }
  const Status written = WriteFileAtomic(file.string(), text.str());
  return written.ok() ? WriteFileAtomic(list.string(), names.str()) : written;
}

}  // namespace skein
