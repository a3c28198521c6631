#include "clients/export/dense_folder.h"

#include <algorithm>
#include <atomic>
#include <map>
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>
#include <thread>
#include <utility>
#include <vector>

#include "clients/export/image_file.h"
#include "core/file.h"
#include "core/threads.h"
#include "depth/consistency.h"
#include "depth/dense_points.h"
#include "depth/depth_scene.h"
#include "depth/depth_sweep.h"
#include "depth/ground_grid.h"
#include "export/geotiff.h"
#include "export/written_names.h"

namespace skein {
namespace {

namespace fs = std::filesystem;

constexpr size_t kNumNeighbours = 3;               // that a photo is matched with
constexpr size_t kNumConfirming = 6;               // maps that may agree with one
constexpr int64_t kSweepBytes = int64_t{2} << 30;  // of all threads

nlohmann::json ToJson(const Eigen::Matrix3d& m) {
  nlohmann::json rows = nlohmann::json::array();
  for (int i = 0; i < 3; ++i) rows.push_back({m(i, 0), m(i, 1), m(i, 2)});
  return rows;
}

class DenseFolder {
 public:
  DenseFolder(const Reconstruction& model, const DenseOptions& options, const PhotoSource& photos,
              const std::function<void()>& on_photo)
      : model_(model),
        scene_(DepthSceneOf(model)),
        options_(options),
        photo_source_(photos),
        on_photo_(on_photo) {}

  Result<DenseFigures> Write(const fs::path& folder) {
    if (Status status = ReadPhotos(); !status.ok()) return status;
    FindNeighbours();
    MakeMaps();
    KeepAgreedDepths();
    DenseFigures figures;
    for (const DepthMap& map : maps_) figures.completeness += map.Completeness() / maps_.size();
    Status status;
    if (Has(kDepth)) status = WriteDepths(folder / "depth");
    if (Has(kDense) || Has(kOrthophoto)) MakePoints();
    if (status.ok() && Has(kDense)) status = WritePoints(folder, &figures);
    if (status.ok() && Has(kOrthophoto)) status = WriteGround(folder, &figures);
    if (!status.ok()) return status;
    return figures;
  }

 private:
  size_t size() const { return scene_.names.size(); }
  bool Has(const std::string& format) const { return options_.formats.count(format) > 0; }

  Status ReadPhotos() {
    std::map<int, PhotoTable> tables;
    for (size_t i = 0; i < size(); ++i) {
      const auto camera_id = static_cast<CameraId>(scene_.cameras[i]);
      const Result<cv::Mat3b> photo =
          ReadPhoto(photo_source_, scene_.names[i], model_.Camera(camera_id));
      if (!photo.ok()) return photo.status();
      const auto table =
          tables.try_emplace(scene_.cameras[i], scene_.lenses[i], options_.size_px).first;
      colours_.push_back(table->second.Apply(*photo));
      cv::Mat1b grey;
      cv::cvtColor(*photo, grey, cv::COLOR_BGR2GRAY);
      photos_.push_back(table->second.Apply(grey, scene_.photos[i].cam_from_world));
    }
    return Status::Ok();
  }

  // The first kNumNeighbours are those that a photo is matched with. Maps confirm each other both
  // ways.
  void FindNeighbours() {
    neighbours_.resize(size());
    ForEachOnThreads(NumThreads(), size(), [&](size_t i) {
      neighbours_[i] =
          ChooseNeighbours(scene_.photos, scene_.points, static_cast<int>(i), kNumConfirming);
    });
    confirming_ = neighbours_;
    for (size_t i = 0; i < size(); ++i) {
      for (const int other : neighbours_[i]) {
        std::vector<int>& back = confirming_[other];
        const int index = static_cast<int>(i);
        if (std::find(back.begin(), back.end(), index) == back.end()) back.push_back(index);
      }
    }
  }

  int NumThreads() const {
    return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  }

  // As many as have room for their sweeps.
  int NumSweepThreads() const {
    int64_t most = 1;
    for (const DepthPhoto& photo : photos_) {
      most = std::max(most, DepthSweepBytes(photo.camera.width, photo.camera.height,
                                            DepthOptions().max_steps, kNumNeighbours));
    }
    return static_cast<int>(std::clamp<int64_t>(kSweepBytes / most, 1, NumThreads()));
  }

  void MakeMaps() {
    maps_.resize(size());
    std::atomic<size_t> next{0};
    RunOnThreads(NumSweepThreads(), [&](int) {
      DepthSweep sweep{DepthOptions()};
      for (size_t i = next++; i < size(); i = next++) {
        maps_[i] = MakeMap(static_cast<int>(i), &sweep);
        on_photo_();
      }
    });
    photos_.clear();
  }

  DepthMap MakeMap(int index, DepthSweep* sweep) const {
    const DepthPhoto& photo = photos_[index];
    std::vector<const DepthPhoto*> neighbours;
    for (const int other : neighbours_[index]) {
      if (neighbours.size() < kNumNeighbours) neighbours.push_back(&photos_[other]);
    }
    const auto range = RangeOfPoints(scene_.photos[index], scene_.points);
    // Without a range nothing is searched: a photo without neighbours has holes alone.
    if (!range) neighbours.clear();
    return *sweep->Estimate(photo, neighbours, range.value_or(DepthRange{1, 2}));
  }

  std::vector<const DepthMap*> Confirming(size_t index) const {
    std::vector<const DepthMap*> others;
    for (const int other : confirming_[index]) others.push_back(&maps_[other]);
    return others;
  }

  void KeepAgreedDepths() {
    std::vector<DepthMap> agreed(size());
    ForEachOnThreads(NumThreads(), size(),
                     [&](size_t i) { agreed[i] = KeepAgreed(maps_[i], Confirming(i)); });
    maps_ = std::move(agreed);
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
      Status status = WritePng(maps_[i].depth, folder / (file + ".png"), &scale);
      if (status.ok()) status = WriteImage(maps_[i].depth, folder / (file + ".pfm"));
      if (status.ok()) status = WriteImage(maps_[i].error, folder / (file + ".error.pfm"));
      if (!status.ok()) return status;
      photos.push_back(Describe(i, file, scale));
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

  nlohmann::json Describe(size_t i, const std::string& file, double scale) const {
    const DepthCamera& camera = maps_[i].camera;
    const DepthPose& pose = maps_[i].cam_from_world;
    return {{"name", scene_.names[i]},
            {"file", file},
            {"png_scale", scale},
            {"width", camera.width},
            {"height", camera.height},
            {"fx", camera.focal_px.x()},
            {"fy", camera.focal_px.y()},
            {"cx", camera.principal_point_px.x()},
            {"cy", camera.principal_point_px.y()},
            {"rotation", ToJson(pose.rotation)},
            {"translation", {pose.translation.x(), pose.translation.y(), pose.translation.z()}},
            {"completeness", maps_[i].Completeness()}};
  }

  void MakePoints() {
    points_.resize(size());
    ForEachOnThreads(NumThreads(), size(), [&](size_t i) {
      points_[i] = PointsOf(maps_[i], colours_[i], Confirming(i));
    });
  }

  Status WritePoints(const fs::path& folder, DenseFigures* figures) const {
    for (const auto& points : points_) figures->num_points += static_cast<int64_t>(points.size());
    std::string ply = "ply\nformat binary_little_endian 1.0\nelement vertex " +
                      std::to_string(figures->num_points) +
                      "\nproperty float x\nproperty float y\nproperty float z\n"
                      "property float nx\nproperty float ny\nproperty float nz\n"
                      "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n";
    for (const auto& points : points_) {
      for (const DensePoint& point : points) Append(point, &ply);
    }
    return WriteFileAtomic((folder / "dense.ply").string(), ply);
  }

  static void Append(const DensePoint& point, std::string* ply) {
    for (const Eigen::Vector3f& v : {point.position, point.normal}) {
      ply->append(reinterpret_cast<const char*>(v.data()), 3 * sizeof(float));
    }
    for (const int channel : {2, 1, 0}) ply->push_back(static_cast<char>(point.colour[channel]));
  }

  Status WriteGround(const fs::path& folder, DenseFigures* figures) const {
    std::vector<ColouredMap> maps;
    for (size_t i = 0; i < size(); ++i) maps.push_back({&maps_[i], &colours_[i], &points_[i]});
    GroundGrid grid = MakeGroundGrid(maps, GroundSamplingDistance(maps));
    if (grid.height.empty()) return FailedPrecondition("no surface that two photos agree on");
    figures->cell_m = grid.cell;
    figures->grid_completeness = grid.Completeness();
    grid.height += options_.origin->altitude_m.value_or(0);
    const GridPlace place{*options_.origin, grid.west, grid.north, grid.cell};
    const Status written = WriteGeoTiff(grid.colour, place, folder / "orthophoto.tif");
    if (!written.ok()) return written;
    return WriteGeoTiff(grid.height, place, folder / "elevation.tif");
  }

  const Reconstruction& model_;
  const DepthScene scene_;
  const DenseOptions& options_;
  const PhotoSource& photo_source_;
  const std::function<void()>& on_photo_;
  std::vector<DepthPhoto> photos_;
  std::vector<cv::Mat3b> colours_;
  std::vector<std::vector<int>> neighbours_, confirming_;  // of each photo
  std::vector<DepthMap> maps_;
  std::vector<std::vector<DensePoint>> points_;  // of each map
};

}  // namespace

Result<DenseFigures> WriteDenseFolder(const Reconstruction& model, const DenseOptions& options,
                                      const PhotoSource& photos,
                                      const std::function<void()>& on_photo,
                                      const fs::path& folder) {
  return DenseFolder(model, options, photos, on_photo).Write(folder);
}

}  // namespace skein
