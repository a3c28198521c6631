#include "export/model_writer.h"

#include <base/camera_models.h>
#include <base/pose.h>

#include <functional>
#include <map>
#include <nlohmann/json.hpp>

#include "core/file.h"
#include "geometry/model_poses.h"

namespace skein {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

using Writer = std::function<Status(const colmap::Reconstruction&, const fs::path&)>;

Status NotWhole(const fs::path& path) {
  return Unavailable("could not write all of " + path.string() + " (is the disk full?)");
}

Status ExpectContent(const fs::path& path, uintmax_t at_least) {
  std::error_code error;
  const uintmax_t size = fs::file_size(path, error);
  return error || size < at_least ? NotWhole(path) : Status::Ok();
}

// Reads the poses and points back and counts them.
Status ExpectModel(const colmap::Reconstruction& model, const fs::path& folder) {
  const Result<ModelPoses> written = ReadColmapPoses(folder);
  if (!written) return written.status();
  if (written->poses.size() != model.NumRegImages() ||
      written->points.points != model.NumPoints3D()) {
    return NotWhole(folder);
  }
  return Status::Ok();
}

// In a folder of its own first: ReadColmapPoses would prefer binary files beside the text.
Status WriteText(const colmap::Reconstruction& model, const fs::path& folder) {
  const fs::path partial = folder / "text.part";
  fs::create_directories(partial);
  model.WriteText(partial.string());
  const Status whole = ExpectModel(model, partial);
  if (whole.ok()) {
    for (const char* name : {"cameras.txt", "images.txt", "points3D.txt"}) {
      fs::rename(partial / name, folder / name);
    }
  }
  fs::remove_all(partial);
  return whole;
}

Status WriteBinary(const colmap::Reconstruction& model, const fs::path& folder) {
  model.WriteBinary(folder.string());
  return ExpectModel(model, folder);
}

Status WritePly(const colmap::Reconstruction& model, const fs::path& folder) {
  constexpr uintmax_t kVertexBytes = 3 * 4 + 3;
  const fs::path path = folder / "points.ply";
  model.ExportPLY(path.string());
  return ExpectContent(path, kVertexBytes * model.NumPoints3D() + 1);
}

Status WriteNerfstudio(const colmap::Reconstruction& model, const fs::path& folder) {
  const std::string text = NerfstudioJson(model);
  return WriteFileAtomic((folder / "transforms.json").string(), text.data(), text.size());
}

// Both formats know one focal length and one radial parameter.
Status ExpectSimpleCameras(const colmap::Reconstruction& model, const std::string& format) {
  for (const auto& [id, camera] : model.Cameras()) {
    if (camera.ModelName() != "SIMPLE_RADIAL" && camera.ModelName() != "SIMPLE_PINHOLE" &&
        !(format == "bundler" && camera.ModelName() == "RADIAL")) {
      return InvalidArgument(format + " cannot hold camera " + std::to_string(id) + " (" +
                             camera.ModelName() + ")");
    }
  }
  return Status::Ok();
}

Status WriteBundler(const colmap::Reconstruction& model, const fs::path& folder) {
  if (Status simple = ExpectSimpleCameras(model, "bundler"); !simple.ok()) return simple;
  const fs::path path = folder / "bundle.out", list = folder / "bundle.out.list.txt";
  if (!model.ExportBundler(path.string(), list.string())) return NotWhole(path);
  const Status whole = ExpectContent(path, 1 + 20 * model.NumPoints3D());
  return whole.ok() ? ExpectContent(list, 1) : whole;
}

Status WriteNvm(const colmap::Reconstruction& model, const fs::path& folder) {
  if (Status simple = ExpectSimpleCameras(model, "nvm"); !simple.ok()) return simple;
  const fs::path path = folder / "model.nvm";
  if (!model.ExportNVM(path.string())) return NotWhole(path);
  return ExpectContent(path, 1 + 20 * model.NumPoints3D());
}

const std::vector<std::pair<std::string, Writer>>& Writers() {
  static const std::vector<std::pair<std::string, Writer>> writers = {
      {"bin", WriteBinary},      {"text", WriteText},
      {"ply", WritePly},         {"nerfstudio", WriteNerfstudio},
      {"bundler", WriteBundler}, {"nvm", WriteNvm}};
  return writers;
}

json FrameJson(const colmap::Image& image, const colmap::Camera& camera) {
  // World-from-camera with OpenGL's axes: y up, z backwards.
  Eigen::Matrix4d transform = Eigen::Matrix4d::Identity();
  transform.topLeftCorner<3, 3>() = colmap::QuaternionToRotationMatrix(image.Qvec()).transpose() *
                                    Eigen::Vector3d(1, -1, -1).asDiagonal();
  transform.topRightCorner<3, 1>() = image.ProjectionCenter();
  json rows = json::array();
  for (int i = 0; i < 4; ++i) {
    rows.push_back({transform(i, 0), transform(i, 1), transform(i, 2), transform(i, 3)});
  }
  json frame = {{"file_path", "images/" + image.Name()},
                {"transform_matrix", rows},
                {"w", camera.Width()},
                {"h", camera.Height()},
                {"fl_x", camera.MeanFocalLength()},
                {"fl_y", camera.MeanFocalLength()},
                {"cx", camera.PrincipalPointX()},
                {"cy", camera.PrincipalPointY()},
                {"k1", 0.0},
                {"k2", 0.0},
                {"p1", 0.0},
                {"p2", 0.0}};
  const std::vector<size_t>& extra = camera.ExtraParamsIdxs();
  const char* names[] = {"k1", "k2", "p1", "p2"};
  for (size_t i = 0; i < std::min<size_t>(extra.size(), 4); ++i) {
    frame[names[i]] = camera.Params(extra[i]);
  }
  return frame;
}

}  // namespace

const std::vector<std::string>& ModelFormats() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all;
    for (const auto& writer : Writers()) all.push_back(writer.first);
    return all;
  }();
  return names;
}

Status WriteModel(const colmap::Reconstruction& model, const std::string& format,
                  const fs::path& folder) {
  for (const auto& [name, write] : Writers()) {
    if (name == format) return write(model, folder);
  }
  return InvalidArgument("there is no format '" + format + "'");
}

std::string NerfstudioJson(const colmap::Reconstruction& model) {
  json transforms = {{"camera_model", "OPENCV"}, {"frames", json::array()}};
  for (const colmap::image_t id : model.RegImageIds()) {
    const colmap::Image& image = model.Image(id);
    transforms["frames"].push_back(FrameJson(image, model.Camera(image.CameraId())));
  }
  return transforms.dump(1);
}

}  // namespace skein
