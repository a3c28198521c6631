#include "export/nerfstudio.h"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <vector>

#include "core/file.h"
#include "export/points_ply.h"
#include "sfm/pose.h"

namespace skein {
namespace {

using nlohmann::json;

constexpr char kPoints[] = "points.ply";

struct NerfstudioCamera {
  std::string model;
  json intrinsics;
};

// nerfstudio's name of each parameter, in COLMAP's order (CameraModelParamsInfo). "f": fl_x = fl_y.
struct ModelNames {
  const char* nerfstudio;
  std::vector<const char*> parameters;
};

const std::map<std::string, ModelNames>& KnownModels() {
  static const std::map<std::string, ModelNames> models = {
      {"SIMPLE_PINHOLE", {"PINHOLE", {"f", "cx", "cy"}}},
      {"PINHOLE", {"PINHOLE", {"fl_x", "fl_y", "cx", "cy"}}},
      {"SIMPLE_RADIAL", {"OPENCV", {"f", "cx", "cy", "k1"}}},
      {"RADIAL", {"OPENCV", {"f", "cx", "cy", "k1", "k2"}}},
      {"OPENCV", {"OPENCV", {"fl_x", "fl_y", "cx", "cy", "k1", "k2", "p1", "p2"}}},
      // k4, k5, k6 of the denominator must be 0.
      {"FULL_OPENCV", {"OPENCV", {"fl_x", "fl_y", "cx", "cy", "k1", "k2", "p1", "p2", "k3"}}},
      {"SIMPLE_RADIAL_FISHEYE", {"OPENCV_FISHEYE", {"f", "cx", "cy", "k1"}}},
      {"RADIAL_FISHEYE", {"OPENCV_FISHEYE", {"f", "cx", "cy", "k1", "k2"}}},
      {"OPENCV_FISHEYE", {"OPENCV_FISHEYE", {"fl_x", "fl_y", "cx", "cy", "k1", "k2", "k3", "k4"}}}};
  return models;
}

Result<NerfstudioCamera> Convert(const Camera& camera) {
  const auto found = KnownModels().find(camera.ModelName());
  const auto refuse = [&](const std::string& why) {
    return InvalidArgument("nerfstudio cannot hold camera " + std::to_string(camera.CameraId()) +
                           " (" + camera.ModelName() + ")" + why +
                           "; with the photos they are undistorted");
  };
  if (found == KnownModels().end()) return refuse("");
  const auto& [name, parameters] = found->second;
  NerfstudioCamera converted{name, {{"w", camera.Width()}, {"h", camera.Height()}}};
  if (converted.model != "PINHOLE") {
    const bool is_fisheye = converted.model == "OPENCV_FISHEYE";
    for (const char* none : {"k1", "k2", is_fisheye ? "k3" : "p1", is_fisheye ? "k4" : "p2"}) {
      converted.intrinsics[none] = 0.0;
    }
  }
  for (size_t i = 0; i < camera.NumParams(); ++i) {
    const double value = camera.Params(i);
    if (i >= parameters.size()) {
      if (value != 0) return refuse(": it divides by a polynomial");
    } else if (std::string(parameters[i]) == "f") {
      converted.intrinsics["fl_x"] = converted.intrinsics["fl_y"] = value;
    } else {
      converted.intrinsics[parameters[i]] = value;
    }
  }
  return converted;
}

// World-from-camera with OpenGL's axes: y up, z backwards.
json TransformMatrix(const Image& image) {
  Eigen::Matrix4d transform = Eigen::Matrix4d::Identity();
  transform.topLeftCorner<3, 3>() = QuaternionToRotationMatrix(image.Qvec()).transpose() *
                                    Eigen::Vector3d(1, -1, -1).asDiagonal();
  transform.topRightCorner<3, 1>() = image.ProjectionCenter();
  json rows = json::array();
  for (int i = 0; i < 4; ++i) {
    rows.push_back({transform(i, 0), transform(i, 1), transform(i, 2), transform(i, 3)});
  }
  return rows;
}

}  // namespace

Result<std::string> NerfstudioJson(const Reconstruction& model, const NerfstudioFilesOf& files_of) {
  std::vector<ImageId> ids = model.RegImageIds();
  std::sort(ids.begin(), ids.end());
  std::map<CameraId, NerfstudioCamera> cameras;
  std::set<std::string> models;
  for (const ImageId id : ids) {
    const CameraId camera_id = model.Image(id).CameraId();
    if (cameras.count(camera_id) > 0) continue;
    const Result<NerfstudioCamera> camera = Convert(model.Camera(camera_id));
    if (!camera.ok()) return camera.status();
    cameras[camera_id] = *camera;
    models.insert(camera->model);
  }
  // A pinhole is an OPENCV camera without distortion, which is what a photo without k1 has.
  if (models.count("OPENCV") > 0) models.erase("PINHOLE");
  if (models.size() > 1) {
    return InvalidArgument(
        "nerfstudio cannot hold fisheye and other cameras in one file; with the "
        "photos they are undistorted");
  }
  json transforms = {{"camera_model", models.empty() ? "OPENCV" : *models.begin()},
                     {"ply_file_path", kPoints},
                     {"frames", json::array()}};
  // What all photos share stands once.
  if (cameras.size() == 1) transforms.update(cameras.begin()->second.intrinsics);
  for (const ImageId id : ids) {
    const Image& image = model.Image(id);
    const NerfstudioFiles files = files_of(image);
    json frame = {{"file_path", files.photo}, {"transform_matrix", TransformMatrix(image)}};
    if (!files.mask.empty()) frame["mask_path"] = files.mask;
    if (cameras.size() > 1) frame.update(cameras.at(image.CameraId()).intrinsics);
    transforms["frames"].push_back(frame);
  }
  return transforms.dump(1);
}

Status WriteNerfstudio(const Reconstruction& model, const std::filesystem::path& folder,
                       const NerfstudioFilesOf& files_of) {
  const Result<std::string> text = NerfstudioJson(model, files_of);
  if (!text.ok()) return text.status();
  if (Status status = WritePointsPly(model, folder / kPoints); !status.ok()) return status;
  return WriteFileAtomic((folder / "transforms.json").string(), *text);
}

}  // namespace skein
