#include "clients/export/dense_folder.h"

#include <algorithm>
#include <atomic>
#include <map>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <thread>
#include <utility>
#include <vector>

#include "core/file.h"
#include "core/threads.h"
#include "depth/consistency.h"
#include "depth/dense_points.h"
#include "depth/depth_scene.h"
#include "depth/depth_sweep.h"
#include "export/written_names.h"

namespace skein {
namespace {

namespace fs = std::filesystem;

constexpr size_t kNumNeighbours = 3;               // that a photo is matched with
constexpr size_t kNumConfirming = 6;               // maps that may agree with one
constexpr int64_t kSweepBytes = int64_t{2} << 30;  // of all threads

Status WriteEncoded(const std::string& extension, const cv::Mat& image, const fs::path& path) {
  Bytes encoded;
  if (!cv::imencode(extension, image, encoded)) {
    return Unavailable("OpenCV cannot encode " + path.string());
  }
  return WriteFileAtomic(path.string(), encoded);
}

nlohmann::json ToJson(const Eigen::Matrix3d& m) {
  nlohmann::json rows = nlohmann::json::array();
  for (int i = 0; i < 3; ++i) rows.push_back({m(i, 0), m(i, 1), m(i, 2)});
  return rows;
}

class DenseFolder {
 public:
  DenseFolder(const Reconstruction& model, int size_px, const PhotoSource& photos,
              const std::function<void()>& on_photo)
      : model_(model),
        scene_(DepthSceneOf(model)),
        size_px_(size_px),
        photo_source_(photos),
        on_photo_(on_photo) {}

  Result<DenseFigures> Write(const std::set<std::string>& formats, const fs::path& folder) {
    if (Status status = ReadPhotos(); !status.ok()) return status;
    FindNeighbours();
    MakeMaps();
    KeepAgreedDepths();
    DenseFigures figures;
    for (const DepthMap& map : maps_) figures.completeness += map.Completeness() / maps_.size();
    Status status;
    if (formats.count(kDepth) > 0) status = WriteDepths(folder / "depth");
    if (status.ok() && formats.count(kDense) > 0) status = WritePoints(folder, &figures);
    if (!status.ok()) return status;
    return figures;
  }

 private:
  size_t size() const { return scene_.names.size(); }

  Status ReadPhotos() {
    std::map<int, PhotoTable> tables;
    for (size_t i = 0; i < size(); ++i) {
      const Result<cv::Mat3b> photo = photo_source_(scene_.names[i]);
      if (!photo.ok()) return photo.status();
      const LensCamera& lens = scene_.lenses[i];
      if (photo->size() != cv::Size(lens.width, lens.height)) {
        return InvalidArgument("photo " + scene_.names[i] + " has not its camera's size");
      }
      const auto table = tables.try_emplace(scene_.cameras[i], lens, size_px_).first;
      colours_.push_back(table->second.Apply(*photo));
      cv::Mat1b grey;
      cv::cvtColor(*photo, grey, cv::COLOR_BGR2GRAY);
      photos_.push_back(table->second.Apply(grey, scene_.photos[i].cam_from_world));
    }
    return Status::Ok();
  }

  // Those that a photo is matched with come first. Whatever may confirm a map may be confirmed by
  // it.
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
      if (status.ok()) status = WriteEncoded(".pfm", maps_[i].depth, folder / (file + ".pfm"));
      if (status.ok()) {
        status = WriteEncoded(".pfm", maps_[i].error, folder / (file + ".error.pfm"));
      }
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
    return WriteEncoded(".png", levels, path);
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

  Status WritePoints(const fs::path& folder, DenseFigures* figures) const {
    std::vector<std::string> parts(size());
    std::atomic<int64_t> num_points{0};
    ForEachOnThreads(NumThreads(), size(), [&](size_t i) {
      const std::vector<DensePoint> points = PointsOf(maps_[i], colours_[i], Confirming(i));
      for (const DensePoint& point : points) Append(point, &parts[i]);
      num_points += static_cast<int64_t>(points.size());
    });
    figures->num_points = num_points;
    std::string ply = "ply\nformat binary_little_endian 1.0\nelement vertex " +
                      std::to_string(num_points) +
                      "\nproperty float x\nproperty float y\nproperty float z\n"
                      "property float nx\nproperty float ny\nproperty float nz\n"
                      "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n";
    for (std::string& part : parts) {
      ply += part;
      part = {};
    }
    return WriteFileAtomic((folder / "dense.ply").string(), ply);
  }

  static void Append(const DensePoint& point, std::string* ply) {
    for (const Eigen::Vector3f& v : {point.position, point.normal}) {
      ply->append(reinterpret_cast<const char*>(v.data()), 3 * sizeof(float));
    }
    for (const int channel : {2, 1, 0}) ply->push_back(static_cast<char>(point.colour[channel]));
  }

  const Reconstruction& model_;
  const DepthScene scene_;
  const int size_px_;
  const PhotoSource& photo_source_;
  const std::function<void()>& on_photo_;
  std::vector<DepthPhoto> photos_;
  std::vector<cv::Mat3b> colours_;
  std::vector<std::vector<int>> neighbours_, confirming_;  // of each photo
  std::vector<DepthMap> maps_;
};

}  // namespace

Result<DenseFigures> WriteDenseFolder(const Reconstruction& model,
                                      const std::set<std::string>& formats, int size_px,
                                      const PhotoSource& photos,
                                      const std::function<void()>& on_photo,
                                      const fs::path& folder) {
  return DenseFolder(model, size_px, photos, on_photo).Write(formats, folder);
}

}  // namespace skein
