#include "export/nvm.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "core/file.h"
#include "export/simple_camera.h"
#include "sfm/model_io.h"

namespace skein {
namespace {

constexpr int kNumRadii = 200;  // at which the distortion is fitted

// Of pairs (undistorted u, distorted m): radii in focal lengths, up to the corner of the photo.
using Radii = std::vector<std::pair<double, double>>;

// Empty where m(u) = u (1 + k u^2) turns back before the corner.
Radii SampleRadii(double k, double corner) {
  Radii radii;
  for (int i = 1; i <= kNumRadii; ++i) {
    const double m = corner * i / kNumRadii;
    double u = radii.empty() ? m : radii.back().first;
    for (int step = 0; step < 50; ++step) {
      const double slope = 1 + 3 * k * u * u;
      if (!(slope > 0)) return {};
      u -= (u * (1 + k * u * u) - m) / slope;
    }
    if (!(std::abs(u * (1 + k * u * u) - m) < 1e-9)) return {};
    radii.emplace_back(u, m);
  }
  return radii;
}

// Least squares of u - m (1 + r m^2).
double FitInverse(const Radii& radii) {
  double numerator = 0, denominator = 0;
  for (const auto& [u, m] : radii) {
    numerator += m * m * m * (u - m);
    denominator += std::pow(m, 6);
  }
  return numerator / denominator;
}

Result<double> NvmDistortion(const Camera& camera) {
  if (Status simple = ExpectSimpleCamera(camera, "nvm"); !simple.ok()) return simple;
  const double k = camera.ModelName() == "SIMPLE_RADIAL" ? camera.Params(3) : 0;
  if (k == 0) return 0.0;
  const double focal = camera.MeanFocalLength();
  const Radii radii = SampleRadii(k, std::hypot(camera.Width(), camera.Height()) / 2 / focal);
  const double r = radii.empty() ? 0 : FitInverse(radii);
  double error_px = 0;
  for (const auto& [u, m] : radii) {
    error_px = std::max(error_px, focal * std::abs(m * (1 + r * m * m) - u));
  }
  const auto longer_px = static_cast<double>(std::max(camera.Width(), camera.Height()));
  if (!radii.empty() && error_px <= kMaxNvmError * longer_px) return r;
  char off[80];
  std::snprintf(off, sizeof off, "it would be off by %.1f px", error_px);
  return InvalidArgument("nvm cannot hold camera " + std::to_string(camera.CameraId()) + " (" +
                         camera.ModelName() + ", k = " + std::to_string(k) +
                         "): " + (radii.empty() ? "its distortion turns back" : off));
}

class NvmText {
 public:
  explicit NvmText(const Reconstruction& model) : model_(model) { text_.precision(17); }

  Result<std::string> Write() {
    std::vector<ImageId> ids = model_.RegImageIds();
    std::sort(ids.begin(), ids.end());
    text_ << "NVM_V3\n\n" << ids.size() << "\n";
    for (const ImageId id : ids) {
      if (Status status = WriteCamera(model_.Image(id)); !status.ok()) return status;
      index_.emplace(id, index_.size());
    }
    text_ << "\n" << model_.NumPoints3D() << "\n";
    for (const Point3DId id : AscendingPoints(model_)) WritePoint(model_.Point3D(id));
    text_ << "\n\n0\n";  // no further model
    return text_.str();
  }

 private:
  Status WriteCamera(const Image& image) {
    const Camera& camera = model_.Camera(image.CameraId());
    const Result<double> distortion = NvmDistortion(camera);
    if (!distortion.ok()) return distortion.status();
    const Eigen::Vector3d centre = image.ProjectionCenter();
    text_ << image.Name() << " " << camera.MeanFocalLength();
    for (int i = 0; i < 4; ++i) text_ << " " << image.Qvec(i);
    for (int i = 0; i < 3; ++i) text_ << " " << centre[i];
    text_ << " " << *distortion << " 0\n";
    return Status::Ok();
  }

  // Of several observations in a photo the first: VisualSFM knows one.
  void WritePoint(const Point3D& point) {
    for (int i = 0; i < 3; ++i) text_ << point.XYZ(i) << " ";
    for (int i = 0; i < 3; ++i) text_ << static_cast<int>(point.Color(i)) << " ";
    std::map<ImageId, Point2DIdx> seen;
    for (const TrackElement& element : point.Track().Elements()) {
      seen.emplace(element.image_id, element.point2D_idx);
    }
    text_ << seen.size();
    for (const auto& [id, index] : seen) {
      const Camera& camera = model_.Camera(model_.Image(id).CameraId());
      const Eigen::Vector2d pixel = model_.Image(id).Point2D(index).XY();
      text_ << " " << index_.at(id) << " " << index << " " << pixel.x() - camera.PrincipalPointX()
            << " " << pixel.y() - camera.PrincipalPointY();
    }
    text_ << "\n";
  }

  const Reconstruction& model_;
  std::map<ImageId, size_t> index_;
  std::ostringstream text_;
};

}  // namespace

Status WriteNvmFile(const Reconstruction& model, const std::filesystem::path& file) {
  const Result<std::string> text = NvmText(model).Write();
  if (!text.ok()) return text.status();
  return WriteFileAtomic(file.string(), *text);
}

}  // namespace skein
