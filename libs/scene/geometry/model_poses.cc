#include "geometry/model_poses.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <sstream>

#include "core/bytes.h"
#include "core/file.h"

namespace skein {
namespace {

namespace fs = std::filesystem;

bool IsRotation(const Eigen::Matrix3d& matrix) {
  return (matrix * matrix.transpose() - Eigen::Matrix3d::Identity()).norm() < 1e-2 &&
         matrix.determinant() > 0;
}

// From qw qx qy qz tx ty tz; nullopt when the quaternion is no rotation.
std::optional<CameraPose> MakePose(const double (&v)[7]) {
  CameraPose pose;
  const Eigen::Quaterniond rotation(v[0], v[1], v[2], v[3]);
  const double norm = rotation.norm();
  if (!std::isfinite(norm) || norm < 1e-9) return std::nullopt;
  pose.rotation = rotation.normalized();
  pose.translation = Eigen::Vector3d(v[4], v[5], v[6]);
  if (!pose.translation.allFinite()) return std::nullopt;
  return pose;
}

CameraPose PoseAt(const Eigen::Quaterniond& cam_from_world, const Eigen::Vector3d& center) {
  return {cam_from_world, -(cam_from_world * center)};
}

Result<std::vector<std::string>> ReadLines(const fs::path& path) {
  const Result<Bytes> bytes = ReadFile(path);
  if (!bytes.ok()) return bytes.status();
  std::istringstream file(std::string(bytes->begin(), bytes->end()));
  std::vector<std::string> lines;
  for (std::string line; std::getline(file, line);) {
    if (!line.empty() && line.back() == '\r') line.pop_back();
    lines.push_back(line);
  }
  return lines;
}

bool IsComment(const std::string& line) {
  const size_t first = line.find_first_not_of(" \t");
  return first == std::string::npos || line[first] == '#';
}

Status Damaged(const fs::path& path, size_t record) {
  return DataLoss(path.string() + ": damaged at record " + std::to_string(record + 1));
}

bool GetName(ByteReader* reader, std::string* name) {
  for (char c = 0; reader->Get(&c);) {
    if (c == 0) return true;
    name->push_back(c);
  }
  return false;
}

bool Skip(ByteReader* reader, uint64_t bytes) {
  uint8_t chunk[24];
  while (bytes >= sizeof chunk) {
    if (!reader->GetRaw(chunk, sizeof chunk)) return false;
    bytes -= sizeof chunk;
  }
  return bytes == 0 || reader->GetRaw(chunk, bytes);
}

// images.bin: count, then id, qvec, tvec, camera id, name, count of points, (x, y, point3D id)s.
Result<std::vector<NamedPose>> ReadImagesBin(const fs::path& path) {
  const Result<Bytes> bytes = ReadFile(path);
  if (!bytes) return bytes.status();
  ByteReader reader(*bytes);
  uint64_t count = 0;
  if (!reader.Get(&count)) return Damaged(path, 0);
  std::vector<NamedPose> poses;
  for (uint64_t i = 0; i < count; ++i) {
    uint32_t image_id = 0, camera_id = 0;
    double v[7] = {};
    NamedPose named;
    uint64_t points = 0;
    bool good = reader.Get(&image_id);
    for (double& value : v) good = good && reader.Get(&value);
    good = good && reader.Get(&camera_id) && GetName(&reader, &named.name) && reader.Get(&points) &&
           points < (1ULL << 32) && Skip(&reader, points * 24);
    const std::optional<CameraPose> pose = MakePose(v);
    if (!good || !pose) return Damaged(path, i);
    named.pose = *pose;
    poses.push_back(named);
  }
  return poses;
}

Result<std::vector<NamedPose>> ReadImagesTxt(const fs::path& path) {
  const Result<std::vector<std::string>> lines = ReadLines(path);
  if (!lines) return lines.status();
  std::vector<NamedPose> poses;
  for (size_t i = 0; i < lines->size(); ++i) {
    if (IsComment((*lines)[i])) continue;
    std::istringstream in((*lines)[i]);
    int64_t image_id = 0, camera_id = 0;
    double v[7] = {};
    NamedPose named;
    in >> image_id;
    for (double& value : v) in >> value;
    in >> camera_id >> std::ws;
    std::getline(in, named.name);
    const std::optional<CameraPose> pose = MakePose(v);
    if (in.fail() || named.name.empty() || !pose) return Damaged(path, i);
    named.pose = *pose;
    poses.push_back(named);
    ++i;  // the line of its points, which may be empty
  }
  return poses;
}

class PointCounter {
 public:
  void Add(double error_px, uint64_t track_length) {
    ++points_;
    error_sum_ += error_px;
    track_sum_ += static_cast<double>(track_length);
  }
  PointStatistics Statistics() const {
    if (points_ == 0) return {};
    return {points_, error_sum_ / points_, track_sum_ / points_};
  }

 private:
  size_t points_ = 0;
  double error_sum_ = 0, track_sum_ = 0;
};

// points3D.bin: count, then id, xyz, rgb, error, length of track, (image id, point2D index)s.
Result<PointStatistics> ReadPointsBin(const fs::path& path) {
  const Result<Bytes> bytes = ReadFile(path);
  if (!bytes) return bytes.status();
  ByteReader reader(*bytes);
  uint64_t count = 0;
  if (!reader.Get(&count)) return Damaged(path, 0);
  PointCounter counter;
  for (uint64_t i = 0; i < count; ++i) {
    double error = 0;
    uint64_t track = 0;
    if (!Skip(&reader, 8 + 24 + 3) || !reader.Get(&error) || !reader.Get(&track) ||
        track >= (1ULL << 32) || !Skip(&reader, track * 8)) {
      return Damaged(path, i);
    }
    counter.Add(error, track);
  }
  return counter.Statistics();
}

Result<PointStatistics> ReadPointsTxt(const fs::path& path) {
  const Result<std::vector<std::string>> lines = ReadLines(path);
  if (!lines) return lines.status();
  PointCounter counter;
  for (size_t i = 0; i < lines->size(); ++i) {
    if (IsComment((*lines)[i])) continue;
    std::istringstream in((*lines)[i]);
    double fields[8] = {};  // id, xyz, rgb, error
    for (double& field : fields) in >> field;
    if (in.fail()) return Damaged(path, i);
    uint64_t numbers = 0;
    for (int64_t number = 0; in >> number;) ++numbers;
    counter.Add(fields[7], numbers / 2);
  }
  return counter.Statistics();
}

bool IsNumber(const std::string& text) {
  std::istringstream in(text);
  double value = 0;
  return in >> value && in.eof();
}

std::vector<fs::path> FilesThatEndWith(const fs::path& folder, const std::string& ending) {
  std::vector<fs::path> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (name.size() > ending.size() &&
        name.compare(name.size() - ending.size(), ending.size(), ending) == 0) {
      files.push_back(entry.path());
    }
  }
  std::sort(files.begin(), files.end());
  return files;
}

}  // namespace

Result<ModelPoses> ReadColmapPoses(const fs::path& folder) {
  const bool binary = fs::exists(folder / "images.bin");
  Result<std::vector<NamedPose>> poses =
      binary ? ReadImagesBin(folder / "images.bin") : ReadImagesTxt(folder / "images.txt");
  if (!poses) return poses.status();
  ModelPoses model;
  model.poses = std::move(*poses);
  const fs::path points = folder / (binary ? "points3D.bin" : "points3D.txt");
  if (!fs::exists(points)) return model;
  const Result<PointStatistics> statistics = binary ? ReadPointsBin(points) : ReadPointsTxt(points);
  if (!statistics) return statistics.status();
  model.points = *statistics;
  return model;
}

Result<ModelPoses> ReadStrechaPoses(const fs::path& folder) {
  ModelPoses model;
  for (const fs::path& file : FilesThatEndWith(folder, ".camera")) {
    const Result<Bytes> bytes = ReadFile(file);
    if (!bytes.ok()) return bytes.status();
    std::istringstream in(std::string(bytes->begin(), bytes->end()));
    double v[24] = {};  // K, three zeros, world_from_cam, centre
    for (double& value : v) in >> value;
    const Eigen::Matrix3d world_from_cam =
        Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(v + 12);
    if (in.fail() || !IsRotation(world_from_cam)) return Damaged(file, 0);
    const Eigen::Quaterniond cam_from_world(Eigen::Matrix3d(world_from_cam.transpose()));
    model.poses.push_back({file.stem().string(), PoseAt(cam_from_world.normalized(),
                                                        Eigen::Vector3d(v[21], v[22], v[23]))});
  }
  return model;
}

Result<ModelPoses> ReadMiddleburyPoses(const fs::path& file) {
  const Result<std::vector<std::string>> lines = ReadLines(file);
  if (!lines) return lines.status();
  ModelPoses model;
  for (size_t i = 1; i < lines->size(); ++i) {  // the first line is their number
    if (IsComment((*lines)[i])) continue;
    std::istringstream in((*lines)[i]);
    NamedPose named;
    double v[21] = {};  // K, cam_from_world rotation and translation
    in >> named.name;
    for (double& value : v) in >> value;
    const Eigen::Matrix3d rotation =
        Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(v + 9);
    if (in.fail() || !IsRotation(rotation)) return Damaged(file, i);
    named.pose.rotation = Eigen::Quaterniond(rotation).normalized();
    named.pose.translation = Eigen::Vector3d(v[18], v[19], v[20]);
    model.poses.push_back(named);
  }
  return model;
}

Result<ModelPoses> ReadTumPoses(const fs::path& file) {
  const Result<std::vector<std::string>> lines = ReadLines(file);
  if (!lines) return lines.status();
  ModelPoses model;
  model.numbered = true;
  for (size_t i = 0; i < lines->size(); ++i) {
    if (IsComment((*lines)[i])) continue;
    std::istringstream in((*lines)[i]);
    std::string name;
    double v[7] = {};  // centre, world_from_cam x y z w
    in >> name;
    for (double& value : v) in >> value;
    const Eigen::Quaterniond world_from_cam(v[6], v[3], v[4], v[5]);
    const double norm = world_from_cam.norm();
    if (in.fail() || !(norm > 0.5 && norm < 2)) return Damaged(file, i);
    model.numbered = model.numbered && IsNumber(name);
    model.poses.push_back(
        {name, PoseAt(world_from_cam.normalized().conjugate(), Eigen::Vector3d(v[0], v[1], v[2]))});
  }
  return model;
}

Result<ModelPoses> ReadPoses(const fs::path& path) {
  if (!fs::exists(path)) return NotFound("there is no " + path.string());
  if (fs::is_directory(path)) {
    if (fs::exists(path / "images.bin") || fs::exists(path / "images.txt")) {
      return ReadColmapPoses(path);
    }
    if (!FilesThatEndWith(path, ".camera").empty()) return ReadStrechaPoses(path);
    const std::vector<fs::path> middlebury = FilesThatEndWith(path, "_par.txt");
    if (!middlebury.empty()) return ReadMiddleburyPoses(middlebury.front());
    return NotFound(path.string() + " holds no images.bin, images.txt, *.camera or *_par.txt");
  }
  const std::string name = path.filename().string();
  if (name.size() > 8 && name.compare(name.size() - 8, 8, "_par.txt") == 0) {
    return ReadMiddleburyPoses(path);
  }
  return ReadTumPoses(path);
}

}  // namespace skein
