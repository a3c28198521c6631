#include "clients/export/dense_folder.h"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>
#include <vector>

#include "clients/export/ground_files.h"
#include "clients/export/image_file.h"
#include "core/file.h"
#include "core/file_below.h"
#include "core/ply.h"
#include "depth/model_depths.h"
#include "export/las.h"
#include "export/written_names.h"
#include "texture/mesh_files.h"
#include "texture/mesh_texture.h"

namespace skein {
namespace {

namespace fs = std::filesystem;

nlohmann::json ToJson(const Eigen::Matrix3d& m) {
  nlohmann::json rows = nlohmann::json::array();
  for (int i = 0; i < 3; ++i) rows.push_back({m(i, 0), m(i, 1), m(i, 2)});
  return rows;
}

class DenseFolder {
 public:
  DenseFolder(const Reconstruction& model, const DenseOptions& options, const PhotoSource& photos)
      : model_(model), scene_(DepthSceneOf(model)), options_(options), photo_source_(photos) {}

  Result<DenseFigures> Write(const std::function<void()>& on_photo, const fs::path& folder) {
    if (Status status = MakeDepths(on_photo, folder); !status.ok()) return status;
    DenseFigures figures;
    figures.quality = QualityOf(depths_, options_.origin.has_value());
    Status status;
    if (Has(kDepth)) status = WriteDepths(folder / "depth");
    if (Has(kDense) || Has(kLas) || Has(kOrthophoto)) points_ = depths_.Points();
    for (const auto& points : points_) figures.num_points += static_cast<int64_t>(points.size());
    if (status.ok() && Has(kDense)) status = WritePoints(figures.num_points, folder / "dense.ply");
    if (status.ok() && Has(kLas)) status = WriteLasPoints(folder / "dense.las");
    if (status.ok() && Has(kMesh)) status = WriteMesh(folder, &figures);
    if (status.ok() && Has(kOrthophoto)) status = WriteGroundFiles(folder, &figures);
    if (status.ok()) status = WriteQuality(figures.quality, folder / "surface.json");
    if (!status.ok()) return status;
    return figures;
  }

 private:
  size_t size() const { return scene_.names.size(); }
  bool Has(const std::string& format) const { return options_.formats.count(format) > 0; }

  Result<cv::Mat3b> Photo(size_t i) const {
    const Camera& camera = model_.Camera(static_cast<CameraId>(scene_.cameras[i]));
    return ReadPhoto(photo_source_, scene_.names[i], camera);
  }

  Status MakeDepths(const std::function<void()>& on_photo, const fs::path& folder) {
    const auto photo = [this](size_t i) { return Photo(i); };
    Result<ModelDepths> depths = MakeModelDepths(scene_, options_.size_px, photo, on_photo, folder);
    if (depths.ok()) depths_ = *std::move(depths);
    return depths.status();
  }

  // ---- Files ----

  Status WriteDepths(const fs::path& folder) const {
    fs::create_directories(folder);
    std::map<std::string, std::string> files;
    for (const auto& [id, file] : FlatNames(model_, "")) files[model_.Image(id).Name()] = file;
    nlohmann::json photos = nlohmann::json::array();
    for (size_t i = 0; i < size(); ++i) {
      const std::string& file = files.at(scene_.names[i]);
      double scale = 0;
      Status status = WritePng(depths_.maps[i].depth, folder / (file + ".png"), &scale);
      if (status.ok()) status = WriteImage(depths_.maps[i].depth, folder / (file + ".pfm"));
      if (status.ok()) status = WriteImage(depths_.maps[i].error, folder / (file + ".error.pfm"));
      std::string mask;
      if (status.ok()) status = WriteMask(i, file, folder, &mask);
      if (!status.ok()) return status;
      photos.push_back(Describe(i, file, mask, scale));
    }
    return WriteFileAtomic((folder / "cameras.json").string(),
                           nlohmann::json{{"photos", photos}}.dump(1) + "\n");
  }

  // scale: depth of a level.
  static Status WritePng(const cv::Mat1f& depth, const fs::path& path, double* scale) {
    constexpr double kMostLevels = 65535;
    double farthest = 0;
    cv::minMaxLoc(depth, nullptr, &farthest);
    *scale = farthest > 0 ? farthest / kMostLevels : 1;
    cv::Mat levels;
    depth.convertTo(levels, CV_16U, 1 / *scale);
    return WriteImage(levels, path);
  }

  // In a folder of masks COLMAP looks for the photo's name. `path`: below `folder`; that of `file`
  // where no file can have the photo's name and an ending, as it is too long or names a folder.
  Status WriteMask(size_t i, const std::string& file, const fs::path& folder,
                   std::string* path) const {
    const cv::Size photo(scene_.lenses[i].width, scene_.lenses[i].height);
    cv::Mat1b mask;
    cv::resize(depths_.masks[i], mask, photo, 0, 0, cv::INTER_NEAREST);
    Status written;
    for (const std::string& name : {scene_.names[i], file}) {
      *path = "masks/" + name + ".png";
      written = CreateFoldersBelow(folder, (folder / *path).parent_path());
      if (written.ok()) written = WriteImage(mask, folder / *path);
      if (written.ok()) break;
    }
    return written;
  }

  nlohmann::json Describe(size_t i, const std::string& file, const std::string& mask,
                          double scale) const {
    const DepthCamera& camera = depths_.maps[i].camera;
    const DepthPose& pose = depths_.maps[i].cam_from_world;
    return {{"name", scene_.names[i]},
            {"file", file},
            {"mask", mask},
            {"png_scale", scale},
            {"width", camera.width},
            {"height", camera.height},
            {"fx", camera.focal_px.x()},
            {"fy", camera.focal_px.y()},
            {"cx", camera.principal_point_px.x()},
            {"cy", camera.principal_point_px.y()},
            {"rotation", ToJson(pose.rotation)},
            {"translation", {pose.translation.x(), pose.translation.y(), pose.translation.z()}},
            {"completeness", depths_.maps[i].Completeness()},
            {"depths", ToJson(depths_.counts[i])}};
  }

  Status WritePoints(int64_t num_points, const fs::path& file) const {
    std::string ply = PlyHeader(static_cast<size_t>(num_points), true) + "end_header\n";
    for (const auto& points : points_) {
      for (const DensePoint& point : points) Append(point, &ply);
    }
    return WriteFileAtomic(file.string(), ply);
  }

  static void Append(const DensePoint& point, std::string* ply) {
    for (const Eigen::Vector3f& v : {Eigen::Vector3f(point.position.cast<float>()), point.normal}) {
      ply->append(reinterpret_cast<const char*>(v.data()), 3 * sizeof(float));
    }
    for (const int channel : {2, 1, 0}) ply->push_back(static_cast<char>(point.colour[channel]));
  }

  Status WriteLasPoints(const fs::path& file) const {
    std::vector<LasPoint> all;
    for (const auto& points : points_) {
      for (const DensePoint& point : points) all.push_back({point.position, point.colour});
    }
    return WriteLas(all, options_.origin, file);
  }

  // With points, if they were made.
  std::vector<ColouredMap> ColouredMaps() const {
    std::vector<ColouredMap> maps;
    for (size_t i = 0; i < size(); ++i) {
      const auto* points = points_.empty() ? nullptr : &points_[i];
      maps.push_back({&depths_.maps[i], &depths_.colours[i], points, &depths_.masks[i]});
    }
    return maps;
  }

  Status WriteMesh(const fs::path& folder, DenseFigures* figures) const {
    MeshOptions options;
    options.max_triangles = options_.mesh_triangles;
    const std::vector<ColouredMap> maps = ColouredMaps();
    const Result<ModelMesh> made = MakeModelMesh(maps, options);
    if (!made.ok()) return made.status();
    const SurfaceMesh& mesh = made->mesh;
    const auto parts = TextureOf(mesh, maps, PhotosForTexture());
    if (!parts.ok()) return parts.status();
    figures->num_triangles = mesh.NumTriangles();
    for (const MeshPart& part : *parts) {
      if (!part.texture.empty())
        figures->num_textured += static_cast<int64_t>(part.indices.size() / 3);
    }
    figures->quality.mesh_voxel = made->voxel;
    const Status written = WriteFileAtomic((folder / "mesh.ply").string(), MeshPly(mesh));
    if (!written.ok()) return written;
    const bool z_up = options_.origin.has_value();
    return WriteFileAtomic((folder / "mesh.glb").string(), MeshGlb(mesh, *parts, z_up));
  }

  // As large as they are.
  TexturePhotos PhotosForTexture() const {
    TexturePhotos photos;
    const auto longer_side = [](const LensCamera& lens) {
      return std::max(lens.width, lens.height);
    };
    for (const LensCamera& lens : scene_.lenses) {
      photos.cameras.push_back(PhotoTable::CameraOf(lens, longer_side(lens)));
    }
    photos.pixels = [=, table = std::optional<PhotoTable>(), camera = -1](size_t i) mutable {
      const LensCamera& lens = scene_.lenses[i];
      const int last = std::exchange(camera, scene_.cameras[i]);
      if (!table || camera != last) table.emplace(lens, longer_side(lens));
      Result<cv::Mat3b> photo = Photo(i);
      return photo.ok() ? table->Apply(*photo) : std::move(photo);
    };
    return photos;
  }

  Status WriteGroundFiles(const fs::path& folder, DenseFigures* figures) const {
    const SurfaceQuality& quality = figures->quality;
    const Ground ground =
        MakeGround(ColouredMaps(), options_.origin, quality.ground_sampling_distance);
    if (ground.grid.height.empty()) {
      return FailedPrecondition("no surface that three photos agree on");
    }
    figures->cell = ground.grid.cell;
    figures->grid_completeness = ground.grid.Completeness();
    figures->up = ground.Up();
    return WriteGround(ground, TextsOf(quality), folder);
  }

  static Status WriteQuality(const SurfaceQuality& quality, const fs::path& file) {
    return WriteFileAtomic(file.string(), ToJson(quality).dump(1) + "\n");
  }

  const Reconstruction& model_;
  const DepthScene scene_;
  const DenseOptions& options_;
  const PhotoSource& photo_source_;
  ModelDepths depths_;
  std::vector<std::vector<DensePoint>> points_;  // of each map
};

}  // namespace

Result<DenseFigures> WriteDenseFolder(const Reconstruction& model, const DenseOptions& options,
                                      const PhotoSource& photos,
                                      const std::function<void()>& on_photo,
                                      const fs::path& folder) {
  return DenseFolder(model, options, photos).Write(on_photo, folder);
}

}  // namespace skein
