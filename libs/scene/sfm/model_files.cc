#include "sfm/model_files.h"

#include <algorithm>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "core/file.h"
#include "sfm/model_io.h"
#include "sfm/pose.h"

namespace skein {
namespace {

namespace fs = std::filesystem;

std::ostringstream Text() {
  std::ostringstream text;
  text.precision(17);  // reads back to the bit
  return text;
}

std::string CamerasText(const Reconstruction& model) {
  std::ostringstream text = Text();
  const std::vector<CameraId> ids = UsedCameras(model);
  text << "# Camera list with one line of data per camera:\n"
          "#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n# Number of cameras: "
       << ids.size() << "\n";
  for (const CameraId id : ids) {
    const Camera& camera = model.Camera(id);
    text << id << " " << camera.ModelName() << " " << camera.Width() << " " << camera.Height();
    for (const double param : camera.Params()) text << " " << param;
    text << "\n";
  }
  return text.str();
}

void AddImage(const Image& image, std::ostream* text) {
  const Eigen::Vector4d q = NormalizeQuaternion(image.Qvec());
  *text << image.ImageId();
  for (int i = 0; i < 4; ++i) *text << " " << q[i];
  for (int i = 0; i < 3; ++i) *text << " " << image.Tvec()[i];
  *text << " " << image.CameraId() << " " << image.Name() << "\n";
  const char* separator = "";
  for (const Point2D& point : image.Points2D()) {
    *text << std::exchange(separator, " ") << point.X() << " " << point.Y() << " "
          << (point.HasPoint3D() ? std::to_string(point.Point3DId()) : "-1");
  }
  *text << "\n";
}

std::string ImagesText(const Reconstruction& model) {
  std::ostringstream text = Text();
  text << "# Image list with two lines of data per image:\n"
          "#   IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n"
          "#   POINTS2D[] as (X, Y, POINT3D_ID)\n# Number of images: "
       << model.NumRegImages() << "\n";
  std::vector<ImageId> ids = model.RegImageIds();
  std::sort(ids.begin(), ids.end());
  for (const ImageId id : ids) AddImage(model.Image(id), &text);
  return text.str();
}

void AddPoint(Point3DId id, const Point3D& point, std::ostream* text) {
  *text << id;
  for (int i = 0; i < 3; ++i) *text << " " << point.XYZ()[i];
  for (int i = 0; i < 3; ++i) *text << " " << static_cast<int>(point.Color()[i]);
  *text << " " << point.Error();
  for (const TrackElement& element : point.Track().Elements()) {
    *text << " " << element.image_id << " " << element.point2D_idx;
  }
  *text << "\n";
}

std::string PointsText(const Reconstruction& model) {
  std::ostringstream text = Text();
  text << "# 3D point list with one line of data per point:\n"
          "#   POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)\n"
          "# Number of points: "
       << model.NumPoints3D() << ", mean track length: " << model.ComputeMeanTrackLength() << "\n";
  for (const Point3DId id : AscendingPoints(model)) AddPoint(id, model.Point3D(id), &text);
  return text.str();
}

// Readers return false on damage.
class TextReader {
 public:
  bool Cameras(std::istream& file) {
    for (std::string line; NextLine(file, &line);) {
      if (!AddCamera(line)) return false;
    }
    return true;
  }

  bool Images(std::istream& file) {
    for (std::string line, points; NextLine(file, &line);) {
      std::getline(file, points);  // empty where a photo has no keypoints
      if (!AddImage(line, points)) return false;
    }
    return true;
  }

  bool Points(std::istream& file) {
    for (std::string line; NextLine(file, &line);) {
      if (!AddPoint(line)) return false;
    }
    return true;
  }

  Reconstruction Take() { return std::move(model_); }

 private:
  // The next one that is no comment.
  static bool NextLine(std::istream& file, std::string* line) {
    while (std::getline(file, *line)) {
      const size_t first = line->find_first_not_of(" \t\r");
      if (first != std::string::npos && (*line)[first] != '#') return true;
    }
    return false;
  }

  bool AddCamera(const std::string& line) {
    std::istringstream in(line);
    CameraId id = 0;
    std::string name;
    size_t width = 0, height = 0;
    if (!(in >> id >> name >> width >> height) || !ExistsCameraModel(name)) return false;
    Camera camera;
    camera.SetCameraId(id);
    camera.SetModelIdFromName(name);
    camera.SetWidth(width);
    camera.SetHeight(height);
    for (double& param : camera.Params()) {
      if (!(in >> param)) return false;
    }
    if (!CanBeAdded(model_, camera)) return false;
    model_.AddCamera(std::move(camera));
    return true;
  }

  bool AddImage(const std::string& line, const std::string& keypoints) {
    std::istringstream in(line);
    ImageId id = 0;
    Eigen::Vector4d qvec;
    Eigen::Vector3d tvec;
    CameraId camera_id = 0;
    std::string name;
    if (!(in >> id >> qvec[0] >> qvec[1] >> qvec[2] >> qvec[3] >> tvec[0] >> tvec[1] >> tvec[2] >>
          camera_id >> name)) {
      return false;
    }
    Image image;
    image.SetImageId(id);
    image.SetCameraId(camera_id);
    image.SetName(name);
    image.SetQvec(qvec);
    image.SetTvec(tvec);
    image.SetPoints2D(Pixels(keypoints));
    if (!CanBeAdded(model_, image)) return false;
    image.SetQvec(NormalizeQuaternion(qvec));
    model_.AddImage(std::move(image));
    model_.RegisterImage(id);
    return true;
  }

  // The points' ids are left to the tracks.
  static std::vector<Eigen::Vector2d> Pixels(const std::string& line) {
    std::istringstream in(line);
    std::vector<Eigen::Vector2d> pixels;
    int64_t point = 0;
    for (double x = 0, y = 0; in >> x >> y >> point;) pixels.emplace_back(x, y);
    return pixels;
  }

  bool AddPoint(const std::string& line) {
    std::istringstream in(line);
    Point3DId id = 0;
    Eigen::Vector3d xyz;
    int rgb[3];
    double error = 0;
    if (!(in >> id >> xyz[0] >> xyz[1] >> xyz[2] >> rgb[0] >> rgb[1] >> rgb[2] >> error)) {
      return false;
    }
    Track track;
    TrackElement element;
    while (in >> element.image_id >> element.point2D_idx) {
      track.AddElement(element);
    }
    if (!CanBeAdded(model_, track)) return false;
    const Point3DId added = model_.AddPoint3D(
        xyz, std::move(track), Eigen::Map<const Eigen::Vector3i>(rgb).cast<uint8_t>());
    model_.Point3D(added).SetError(error);
    return true;
  }

  Reconstruction model_;
};

template <class Parse>
Status ReadTextFile(const fs::path& file, const Parse& parse) {
  const Result<Bytes> bytes = ReadFile(file.string());
  if (!bytes) return bytes.status();
  std::istringstream in(std::string(bytes->begin(), bytes->end()));
  return parse(in) ? Status::Ok() : DataLoss(file.string() + " is damaged");
}

Result<Reconstruction> ReadText(const fs::path& folder) {
  TextReader reader;
  Status read =
      ReadTextFile(folder / "cameras.txt", [&](std::istream& in) { return reader.Cameras(in); });
  if (read.ok()) {
    read = ReadTextFile(folder / "images.txt", [&](std::istream& in) { return reader.Images(in); });
  }
  if (read.ok()) {
    read =
        ReadTextFile(folder / "points3D.txt", [&](std::istream& in) { return reader.Points(in); });
  }
  if (!read.ok()) return read;
  return reader.Take();
}

}  // namespace

Result<Reconstruction> ReadModelFiles(const fs::path& folder) {
  const bool binary = fs::exists(folder / "points3D.bin");
  ModelArchive archive;
  for (const char* name : {"cameras", "images", "points3D"}) {
    const fs::path file = folder / (std::string(name) + (binary ? ".bin" : ".txt"));
    if (!fs::exists(file)) return NotFound("there is no " + file.string());
    if (!binary) continue;
    Result<Bytes> bytes = ReadFile(file.string());
    if (!bytes) return bytes.status();
    archive[file.filename().string()] = std::move(*bytes);
  }
  if (!binary) return ReadText(folder);
  Result<Reconstruction> model = DecodeModel(std::move(archive));
  if (!model) return model.status().Within(folder.string());
  return model;
}

Status WriteModelBinary(const Reconstruction& model, const fs::path& folder) {
  for (const auto& [name, bytes] : EncodeModel(model)) {
    const Status written = WriteFileAtomic((folder / name).string(), bytes);
    if (!written.ok()) return written;
  }
  return Status::Ok();
}

Status WriteModelText(const Reconstruction& model, const fs::path& folder) {
  Status written = WriteFileAtomic((folder / "cameras.txt").string(), CamerasText(model));
  if (written.ok()) written = WriteFileAtomic((folder / "images.txt").string(), ImagesText(model));
  return written.ok() ? WriteFileAtomic((folder / "points3D.txt").string(), PointsText(model))
                      : written;
}

}  // namespace skein
