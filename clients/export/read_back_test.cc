// What `skein export` writes, read by readers after each format's own documentation. They share no
// code with the writers, nor with COLMAP: OpenCV projects.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstring>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>

#include "clients/export/training_folder.h"
#include "export/model_writer.h"
#include "export/nerfstudio.h"
#include "export/nvm.h"
#include "export/written_names.h"
#include "sfm/reconstruction.h"
#include "testing/test_folder.h"

namespace skein::read_back_test {

namespace fs = std::filesystem;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

// ---- What is written.

constexpr int kWidth = 640, kHeight = 480;

struct Lens {
  std::string model;
  std::vector<double> params;
};

const Lens kSimpleRadial{"SIMPLE_RADIAL", {500, 320, 240, -0.06}};
const Lens kOpenCv{"OPENCV", {500, 480, 310, 245, -0.1, 0.02, 0.002, -0.001}};
const Lens kFisheye{"OPENCV_FISHEYE", {400, 430, 320, 240, -0.02, 0.003, -0.004, 0.005}};

// Four photos of points on a slanted grid; a camera for each of `lenses` in turn. What a photo
// shows of them are discs.
class Scene {
 public:
  explicit Scene(const std::vector<Lens>& lenses, const std::string& name_begin = "alice/") {
    for (size_t i = 0; i < lenses.size(); ++i) {
      Camera camera;
      camera.SetCameraId(static_cast<CameraId>(i + 1));
      camera.SetModelIdFromName(lenses[i].model);
      camera.SetWidth(kWidth);
      camera.SetHeight(kHeight);
      camera.SetParams(lenses[i].params);
      model_.AddCamera(camera);
    }
    for (int y = -1; y <= 1; ++y) {
      for (int x = -2; x <= 2; ++x) points_.emplace_back(x, 0.8 * y, 5 + 0.3 * x - 0.2 * y);
    }
    for (int i = 0; i < 4; ++i) AddPhoto(i, name_begin, lenses.size());
    for (size_t p = 0; p < points_.size(); ++p) AddPoint(p);
  }

  const Reconstruction& model() const { return model_; }
  const std::vector<Vector3d>& points() const { return points_; }

  PhotoSource Photos() const {
    return [this](const std::string& name) -> Result<cv::Mat3b> {
      for (const ImageId id : model_.RegImageIds()) {
        if (model_.Image(id).Name() == name) return Draw(model_.Image(id));
      }
      return NotFound("no photo " + name);
    };
  }

 private:
  void AddPhoto(int i, const std::string& name_begin, size_t num_lenses) {
    Image image;
    image.SetImageId(static_cast<ImageId>(i + 1));
    image.SetCameraId(static_cast<CameraId>(i % num_lenses + 1));
    image.SetName(name_begin + std::to_string(i) + ".png");
    const Eigen::Quaterniond q(
        Eigen::AngleAxisd(0.1 * (i - 1), Vector3d(0.3, 1, 0.2).normalized()));
    const Vector3d centre(0.4 * i - 0.6, 0.1 * i, 0.2 * i);
    image.SetQvec({q.w(), q.x(), q.y(), q.z()});
    image.SetTvec(-(q * centre));
    const Camera& camera = model_.Camera(image.CameraId());
    std::vector<Vector2d> pixels;
    for (const Vector3d& point : points_) {
      pixels.push_back(camera.WorldToImage((q * (point - centre)).hnormalized()));
    }
    image.SetPoints2D(pixels);
    model_.AddImage(image);
    model_.RegisterImage(image.ImageId());
  }
  void AddPoint(size_t p) {
    Track track;
    for (int i = 0; i < 4; ++i) {
      track.AddElement(static_cast<ImageId>(i + 1), static_cast<Point2DIdx>(p));
    }
    const auto red = static_cast<uint8_t>(10 * p);
    model_.AddPoint3D(points_[p], track, Eigen::Matrix<uint8_t, 3, 1>(red, 100, 200));
  }
  static cv::Mat3b Draw(const Image& image) {
    constexpr int kShift = 6;
    cv::Mat3b photo(kHeight, kWidth, cv::Vec3b::all(0));
    for (const Point2D& point : image.Points2D()) {
      const cv::Point centre(static_cast<int>(std::lround((point.X() - 0.5) * (1 << kShift))),
                             static_cast<int>(std::lround((point.Y() - 0.5) * (1 << kShift))));
      cv::circle(photo, centre, 6 << kShift, cv::Scalar::all(255), -1, cv::LINE_AA, kShift);
    }
    return photo;
  }

  Reconstruction model_;
  std::vector<Vector3d> points_;
};

// ---- What readers make of it.

std::string Slurp(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  EXPECT_TRUE(in) << path;
  return {std::istreambuf_iterator<char>(in), {}};
}

struct Ply {
  std::vector<Vector3d> points;
  std::vector<std::array<uint8_t, 3>> colours;
};

// "The PLY Polygon File Format" (Turk 1994): binary, x y z as floats, red green blue as uchars.
Ply ReadPly(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::string line;
  std::vector<std::string> properties;
  size_t count = 0;
  while (std::getline(in, line) && line != "end_header") {
    std::istringstream words(line);
    std::string first, second, third;
    words >> first >> second >> third;
    if (first == "element" && second == "vertex") count = std::stoul(third);
    if (first == "property") properties.push_back(second + " " + third);
    if (first == "format") {
      EXPECT_EQ(second, "binary_little_endian");
    }
  }
  EXPECT_EQ(properties, (std::vector<std::string>{"float x", "float y", "float z", "uchar red",
                                                  "uchar green", "uchar blue"}));
  Ply ply;
  for (size_t i = 0; i < count; ++i) {
    float xyz[3];
    std::array<uint8_t, 3> rgb;
    in.read(reinterpret_cast<char*>(xyz), sizeof xyz);
    in.read(reinterpret_cast<char*>(rgb.data()), 3);
    EXPECT_TRUE(in);
    ply.points.emplace_back(xyz[0], xyz[1], xyz[2]);
    ply.colours.push_back(rgb);
  }
  EXPECT_EQ(in.peek(), EOF);
  return ply;
}

std::vector<Vector3d> Sorted(std::vector<Vector3d> points) {
  std::sort(points.begin(), points.end(), [](const Vector3d& a, const Vector3d& b) {
    return std::make_tuple(a.x(), a.y()) < std::make_tuple(b.x(), b.y());
  });
  return points;
}

void ExpectPoints(const std::vector<Vector3d>& found, const std::vector<Vector3d>& expected) {
  ASSERT_EQ(found.size(), expected.size());
  const std::vector<Vector3d> a = Sorted(found), b = Sorted(expected);
  for (size_t i = 0; i < a.size(); ++i) EXPECT_LT((a[i] - b[i]).norm(), 1e-5) << i;
}

// A photo of transforms.json (docs.nerf.studio, "Data conventions").
struct NerfFrame {
  nlohmann::json intrinsics;
  Matrix3d cam_from_world;  // OpenCV's axes
  Vector3d translation;
  std::string camera_model, photo, mask;

  double Get(const char* name) const {
    return intrinsics.contains(name) ? intrinsics[name].get<double>() : 0;
  }
  Vector2d Project(const Vector3d& point) const {
    const Vector3d p = cam_from_world * point + translation;
    const std::vector<cv::Point3d> points = {{p.x(), p.y(), p.z()}};
    const cv::Matx33d K(Get("fl_x"), 0, Get("cx"), 0, Get("fl_y"), Get("cy"), 0, 0, 1);
    std::vector<cv::Point2d> pixels;
    const cv::Vec3d zero(0, 0, 0);
    if (camera_model == "OPENCV_FISHEYE") {
      cv::fisheye::projectPoints(points, pixels, zero, zero, K,
                                 cv::Vec4d(Get("k1"), Get("k2"), Get("k3"), Get("k4")));
    } else {
      cv::projectPoints(points, zero, zero, K,
                        cv::Vec<double, 5>(Get("k1"), Get("k2"), Get("p1"), Get("p2"), Get("k3")),
                        pixels);
    }
    return {pixels[0].x, pixels[0].y};
  }
};

std::vector<NerfFrame> ReadNerfstudio(const fs::path& folder, std::string* ply) {
  const auto meta = nlohmann::json::parse(Slurp(folder / "transforms.json"));
  *ply = meta.at("ply_file_path");
  std::vector<NerfFrame> frames;
  for (const auto& frame : meta.at("frames")) {
    NerfFrame read;
    read.intrinsics = meta.contains("fl_x") ? meta : frame;
    read.camera_model = meta.at("camera_model");
    read.photo = frame.at("file_path");
    read.mask = frame.value("mask_path", "");
    Eigen::Matrix4d world_from_cam;
    for (int row = 0; row < 4; ++row) {
      for (int column = 0; column < 4; ++column) {
        world_from_cam(row, column) = frame.at("transform_matrix").at(row).at(column);
      }
    }
    EXPECT_EQ(world_from_cam.row(3), Eigen::RowVector4d(0, 0, 0, 1));
    // +X right, +Y up, +Z back to OpenCV's right, down, forward.
    const Matrix3d turned = world_from_cam.topLeftCorner<3, 3>() * Vector3d(1, -1, -1).asDiagonal();
    read.cam_from_world = turned.transpose();
    read.translation = -(read.cam_from_world * world_from_cam.topRightCorner<3, 1>());
    frames.push_back(read);
  }
  return frames;
}

// COLMAP's binary format (colmap.github.io/format.html).
struct ColmapPhoto {
  std::string name;
  Matrix3d cam_from_world;
  Vector3d translation;
  uint32_t camera_id = 0;
  std::vector<Vector2d> pixels;
  std::vector<int64_t> point_ids;
};
struct ColmapCamera {
  std::string model;
  uint64_t width = 0, height = 0;
  std::vector<double> params;
};
struct ColmapModel {
  std::map<uint32_t, ColmapCamera> cameras;
  std::vector<ColmapPhoto> photos;
  std::map<int64_t, Vector3d> points;
};

class BinaryFile {
 public:
  explicit BinaryFile(const fs::path& path) : bytes_(Slurp(path)) {}
  ~BinaryFile() { EXPECT_EQ(at_, bytes_.size()) << "bytes are left"; }
  template <class T>
  T Get() {
    T value{};
    EXPECT_LE(at_ + sizeof(T), bytes_.size());
    if (at_ + sizeof(T) <= bytes_.size()) std::memcpy(&value, &bytes_[at_], sizeof(T));
    at_ += sizeof(T);
    return value;
  }

 private:
  const std::string bytes_;
  size_t at_ = 0;
};

template <class Get>
ColmapPhoto ReadPose(const Get& get) {
  ColmapPhoto photo;
  double q[4], t[3];
  for (double& value : q) value = get();
  for (double& value : t) value = get();
  photo.cam_from_world = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).toRotationMatrix();
  photo.translation = {t[0], t[1], t[2]};
  return photo;
}

ColmapModel ReadColmapBinary(const fs::path& folder) {
  const std::map<int, std::pair<const char*, int>> models = {
      {1, {"PINHOLE", 4}}, {2, {"SIMPLE_RADIAL", 4}}, {4, {"OPENCV", 8}}};
  ColmapModel model;
  BinaryFile cameras(folder / "cameras.bin");
  for (auto n = cameras.Get<uint64_t>(); n > 0; --n) {
    ColmapCamera& camera = model.cameras[cameras.Get<uint32_t>()];
    const auto& [name, num_params] = models.at(cameras.Get<int32_t>());
    camera.model = name;
    camera.width = cameras.Get<uint64_t>();
    camera.height = cameras.Get<uint64_t>();
    for (int i = 0; i < num_params; ++i) camera.params.push_back(cameras.Get<double>());
  }
  BinaryFile images(folder / "images.bin");
  for (auto n = images.Get<uint64_t>(); n > 0; --n) {
    images.Get<uint32_t>();
    ColmapPhoto photo = ReadPose([&] { return images.Get<double>(); });
    photo.camera_id = images.Get<uint32_t>();
    for (char c = images.Get<char>(); c != '\0'; c = images.Get<char>()) photo.name += c;
    for (auto k = images.Get<uint64_t>(); k > 0; --k) {
      const auto x = images.Get<double>(), y = images.Get<double>();
      photo.pixels.emplace_back(x, y);
      photo.point_ids.push_back(images.Get<int64_t>());
    }
    model.photos.push_back(photo);
  }
  BinaryFile points(folder / "points3D.bin");
  for (auto n = points.Get<uint64_t>(); n > 0; --n) {
    Vector3d& point = model.points[static_cast<int64_t>(points.Get<uint64_t>())];
    for (int i = 0; i < 3; ++i) point[i] = points.Get<double>();
    for (int i = 0; i < 3; ++i) points.Get<uint8_t>();
    points.Get<double>();
    for (auto k = points.Get<uint64_t>(); k > 0; --k) points.Get<uint64_t>();
  }
  return model;
}

// The text format, as readers do it that split a line at blanks.
ColmapModel ReadColmapText(const fs::path& folder) {
  const auto rows = [&](const char* name) {
    std::vector<std::vector<std::string>> all;
    std::ifstream in(folder / name);
    for (std::string line; std::getline(in, line);) {
      if (!line.empty() && line[0] == '#') continue;
      std::istringstream words(line);
      all.emplace_back(std::istream_iterator<std::string>(words),
                       std::istream_iterator<std::string>());
    }
    return all;
  };
  ColmapModel model;
  for (const auto& row : rows("cameras.txt")) {
    ColmapCamera& camera = model.cameras[static_cast<uint32_t>(std::stoul(row.at(0)))];
    camera.model = row.at(1);
    camera.width = std::stoul(row.at(2));
    camera.height = std::stoul(row.at(3));
    for (size_t i = 4; i < row.size(); ++i) camera.params.push_back(std::stod(row[i]));
  }
  const auto images = rows("images.txt");
  for (size_t i = 0; i + 1 < images.size(); i += 2) {
    EXPECT_EQ(images[i].size(), 10u) << "a blank in a name";
    size_t at = 1;
    ColmapPhoto photo = ReadPose([&] { return std::stod(images[i].at(at++)); });
    photo.camera_id = static_cast<uint32_t>(std::stoul(images[i].at(8)));
    photo.name = images[i].at(9);
    for (size_t k = 0; k + 2 < images[i + 1].size(); k += 3) {
      photo.pixels.emplace_back(std::stod(images[i + 1][k]), std::stod(images[i + 1][k + 1]));
      photo.point_ids.push_back(std::stoll(images[i + 1][k + 2]));
    }
    model.photos.push_back(photo);
  }
  for (const auto& row : rows("points3D.txt")) {
    model.points[std::stoll(row.at(0))] = {std::stod(row.at(1)), std::stod(row.at(2)),
                                           std::stod(row.at(3))};
  }
  return model;
}

// Of a pinhole, or SIMPLE_RADIAL.
Vector2d ProjectSimply(const ColmapCamera& camera, const Vector3d& p) {
  const Vector2d u(p.x() / p.z(), p.y() / p.z());
  if (camera.model == "PINHOLE") {
    return {camera.params[0] * u.x() + camera.params[2],
            camera.params[1] * u.y() + camera.params[3]};
  }
  EXPECT_EQ(camera.model, "SIMPLE_RADIAL");
  const double factor = 1 + camera.params[3] * u.squaredNorm();
  return camera.params[0] * factor * u + Vector2d(camera.params[1], camera.params[2]);
}

void ExpectSmallResiduals(const ColmapModel& model, double limit_px) {
  for (const ColmapPhoto& photo : model.photos) {
    ASSERT_EQ(photo.pixels.size(), 15u);
    for (size_t i = 0; i < photo.pixels.size(); ++i) {
      const Vector3d& point = model.points.at(photo.point_ids[i]);
      const Vector2d pixel = ProjectSimply(model.cameras.at(photo.camera_id),
                                           photo.cam_from_world * point + photo.translation);
      EXPECT_LT((pixel - photo.pixels[i]).norm(), limit_px) << photo.name << " " << i;
    }
  }
}

std::map<std::string, std::string> ReadNames(const fs::path& file) {
  std::map<std::string, std::string> names;
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    const size_t tab = line.find('\t');
    names[line.substr(0, tab)] = line.substr(tab + 1);
  }
  return names;
}

// Centre of the bright disc around `near`, in pixels with the centre of the first at 0.5, 0.5.
std::optional<Vector2d> FindDisc(const cv::Mat1b& photo, const Vector2d& near) {
  constexpr int kReach = 14;
  const cv::Rect window(static_cast<int>(near.x()) - kReach, static_cast<int>(near.y()) - kReach,
                        2 * kReach + 1, 2 * kReach + 1);
  if ((window & cv::Rect({}, photo.size())) != window) return std::nullopt;
  const cv::Moments moments = cv::moments(photo(window));
  if (moments.m00 < 255 * 20) return std::nullopt;
  return Vector2d(window.x + moments.m10 / moments.m00 + 0.5,
                  window.y + moments.m01 / moments.m00 + 0.5);
}

cv::Mat1b ReadGrey(const fs::path& path) {
  const cv::Mat1b photo = cv::imread(path.string(), cv::IMREAD_GRAYSCALE);
  EXPECT_FALSE(photo.empty()) << path;
  return photo;
}

// ---- Each format.

TEST(ReadBack, NerfstudioTrainsAsItIs) {
  for (const std::vector<Lens>& lenses :
       {std::vector<Lens>{kSimpleRadial}, {kOpenCv}, {kFisheye}, {kFisheye, kOpenCv}}) {
    const Scene scene(lenses, "alice/trip 1/");
    const TestFolder folder;
    const Status written = WriteTrainingFolder(
        scene.model(), {kNerfstudio}, scene.Photos(), [] {}, folder.path());
    ASSERT_TRUE(written.ok()) << written.error();
    std::string ply;
    const std::vector<NerfFrame> frames = ReadNerfstudio(folder.path(), &ply);
    ExpectPoints(ReadPly(folder / ply).points, scene.points());
    ASSERT_EQ(frames.size(), 4u);
    int num_found = 0;
    for (const NerfFrame& frame : frames) {
      EXPECT_EQ(frame.camera_model, "PINHOLE");
      EXPECT_FALSE(frame.intrinsics.contains("k1"));
      EXPECT_EQ(frame.mask, "") << "there is no border";
      const cv::Mat1b photo = ReadGrey(folder / frame.photo);
      EXPECT_EQ(photo.cols, frame.Get("w"));
      EXPECT_EQ(photo.rows, frame.Get("h"));
      EXPECT_EQ(frame.Get("cx"), photo.cols / 2.0);
      EXPECT_EQ(frame.Get("cy"), photo.rows / 2.0);
      for (const Vector3d& point : scene.points()) {
        const Vector2d pixel = frame.Project(point);
        const std::optional<Vector2d> disc = FindDisc(photo, pixel);
        if (!disc) continue;
        ++num_found;
        EXPECT_LT((*disc - pixel).norm(), 0.5) << frame.photo << " " << pixel.transpose();
      }
    }
    EXPECT_GT(num_found, 40) << lenses[0].model;
    const auto names = ReadNames(folder / "images.names.txt");
    EXPECT_EQ(names.at("alice_trip_1_0.jpg"), "alice/trip 1/0.png");
  }
}

TEST(ReadBack, GaussianSplattingTrainsAsItIs) {
  for (const std::vector<Lens>& lenses : {std::vector<Lens>{kSimpleRadial}, {kFisheye, kOpenCv}}) {
    const Scene scene(lenses);
    const TestFolder folder;
    const Status written = WriteTrainingFolder(
        scene.model(), {kGaussianSplatting}, scene.Photos(), [] {}, folder.path());
    ASSERT_TRUE(written.ok()) << written.error();
    EXPECT_FALSE(fs::exists(folder / "transforms.json"));
    const ColmapModel model = ReadColmapBinary(folder / "sparse/0");
    EXPECT_EQ(model.cameras.size(), lenses.size());
    ExpectSmallResiduals(model, 1e-3);
    ASSERT_EQ(model.photos.size(), 4u);
    for (const ColmapPhoto& photo : model.photos) {
      // Readers that know a field of view alone take the principal point to be in the middle, and
      // the name without its folder.
      const ColmapCamera& camera = model.cameras.at(photo.camera_id);
      EXPECT_EQ(camera.model, "PINHOLE");
      EXPECT_EQ(camera.params[2], static_cast<double>(camera.width) / 2);
      EXPECT_EQ(camera.params[3], static_cast<double>(camera.height) / 2);
      const cv::Mat1b pixels = ReadGrey(folder / "images" / fs::path(photo.name).filename());
      EXPECT_EQ(static_cast<uint64_t>(pixels.cols), camera.width);
      EXPECT_EQ(static_cast<uint64_t>(pixels.rows), camera.height);
    }
  }
}

TEST(ReadBack, BordersAreTransparentAndMasked) {
  const Scene scene({{"SIMPLE_RADIAL", {250, 320, 240, -0.4}}, kSimpleRadial});
  const TestFolder folder;
  const Status written = WriteTrainingFolder(
      scene.model(), {kNerfstudio, kGaussianSplatting}, scene.Photos(), [] {}, folder.path());
  ASSERT_TRUE(written.ok()) << written.error();
  std::string ply;
  int num_masked = 0;
  for (const NerfFrame& frame : ReadNerfstudio(folder.path(), &ply)) {
    const cv::Mat photo = cv::imread((folder / frame.photo).string(), cv::IMREAD_UNCHANGED);
    ASSERT_EQ(photo.channels(), 4) << "all alike, as batches are of one shape";
    cv::Mat1b alpha;
    cv::extractChannel(photo, alpha, 3);
    const cv::Mat1b mask = ReadGrey(folder / frame.mask);
    ASSERT_EQ(mask.size(), photo.size());
    EXPECT_EQ(cv::norm(mask, alpha, cv::NORM_INF), 0);
    num_masked += cv::countNonZero(mask) < mask.rows * mask.cols;
  }
  EXPECT_EQ(num_masked, 2);
  std::set<std::string> names;
  for (const auto& photo : ReadColmapBinary(folder / "sparse/0").photos) names.insert(photo.name);
  EXPECT_EQ(names.count("alice_0.png"), 1u);
}

TEST(ReadBack, NerfstudioHasEachCameraAsItIsWithoutPhotos) {
  const Lens lenses[] = {
      {"SIMPLE_PINHOLE", {500, 320, 240}},
      {"PINHOLE", {500, 490, 310, 250}},
      kSimpleRadial,
      {"RADIAL", {500, 320, 240, -0.1, 0.02}},
      kOpenCv,
      {"FULL_OPENCV", {500, 480, 310, 245, -0.1, 0.02, 0.002, -0.001, 0.03, 0, 0, 0}},
      kFisheye,
      {"SIMPLE_RADIAL_FISHEYE", {400, 320, 240, 0.02}},
      {"RADIAL_FISHEYE", {400, 320, 240, 0.02, -0.01}}};
  for (const Lens& lens : lenses) {
    const Scene scene({lens});
    const TestFolder folder;
    const Status written = WriteModel(scene.model(), "nerfstudio", folder.path());
    ASSERT_TRUE(written.ok()) << written.error();
    std::string ply;
    const std::vector<NerfFrame> frames = ReadNerfstudio(folder.path(), &ply);
    ExpectPoints(ReadPly(folder / ply).points, scene.points());
    ASSERT_EQ(frames.size(), 4u);
    for (size_t i = 0; i < frames.size(); ++i) {
      const Image& image = scene.model().Image(static_cast<ImageId>(i + 1));
      EXPECT_EQ(frames[i].photo, "images/" + image.Name());
      for (size_t p = 0; p < scene.points().size(); ++p) {
        const Vector2d pixel = frames[i].Project(scene.points()[p]);
        EXPECT_LT((pixel - image.Point2D(static_cast<Point2DIdx>(p)).XY()).norm(), 1e-3)
            << lens.model;
      }
    }
  }
}

TEST(ReadBack, NerfstudioRefusesCamerasThatItHasNoWordsFor) {
  const TestFolder folder;
  const auto refused = [&](const std::vector<Lens>& lenses) {
    return WriteModel(Scene(lenses).model(), "nerfstudio", folder.path()).error();
  };
  EXPECT_NE(refused({{"FOV", {400, 400, 320, 240, 0.8}}}).find("camera 1 (FOV)"),
            std::string::npos);
  EXPECT_NE(
      refused({{"FULL_OPENCV", {500, 480, 310, 245, 0, 0, 0, 0, 0, 0.01, 0, 0}}}).find("divides"),
      std::string::npos);
  EXPECT_NE(refused({{"THIN_PRISM_FISHEYE", {500, 480, 310, 245, 0, 0, 0, 0, 0, 0, 0, 0}}}), "");
  EXPECT_NE(refused({kFisheye, kOpenCv}).find("fisheye"), std::string::npos);
  EXPECT_FALSE(fs::exists(folder / "transforms.json"));
  EXPECT_EQ(refused({kOpenCv, {"PINHOLE", {500, 490, 310, 250}}}), "");
}

// Snavely's "Bundler v0.4 user's manual", output format.
TEST(ReadBack, BundlerProjectsWhereThePhotosShowIt) {
  for (const Lens& lens : {kSimpleRadial, Lens{"RADIAL", {500, 320, 240, -0.1, 0.02}},
                           Lens{"SIMPLE_PINHOLE", {500, 320, 240}}}) {
    const Scene scene({lens}, "alice/trip 1 ");
    const TestFolder folder;
    const Status written = WriteModel(scene.model(), "bundler", folder.path());
    ASSERT_TRUE(written.ok()) << written.error();
    std::ifstream in(folder / "bundle.out");
    std::string line;
    std::getline(in, line);
    EXPECT_EQ(line, "# Bundle file v0.3");
    size_t num_cameras = 0, num_points = 0;
    in >> num_cameras >> num_points;
    ASSERT_EQ(num_cameras, 4u);
    ASSERT_EQ(num_points, scene.points().size());
    struct Camera {
      double f, k1, k2;
      Matrix3d R;
      Vector3d t;
    };
    std::vector<Camera> cameras(num_cameras);
    for (Camera& camera : cameras) {
      in >> camera.f >> camera.k1 >> camera.k2;
      for (int i = 0; i < 9; ++i) in >> camera.R(i / 3, i % 3);
      for (int i = 0; i < 3; ++i) in >> camera.t[i];
    }
    std::vector<Vector3d> points;
    for (size_t p = 0; p < num_points; ++p) {
      Vector3d point;
      int red, green, blue;
      size_t length;
      in >> point[0] >> point[1] >> point[2] >> red >> green >> blue >> length;
      points.push_back(point);
      EXPECT_EQ(length, 4u);
      for (size_t v = 0; v < length; ++v) {
        size_t index, key;
        Vector2d seen;
        in >> index >> key >> seen[0] >> seen[1];
        const Camera& camera = cameras.at(index);
        const Vector3d P = camera.R * point + camera.t;
        const Vector2d u(-P.x() / P.z(), -P.y() / P.z());
        const double r2 = u.squaredNorm();
        const Vector2d pixel = camera.f * (1 + camera.k1 * r2 + camera.k2 * r2 * r2) * u;
        EXPECT_LT((pixel - seen).norm(), 0.01) << "COLMAP writes six digits";
      }
    }
    EXPECT_TRUE(in);
    ExpectPoints(points, scene.points());
    std::ifstream list(folder / "bundle.out.list.txt");
    std::string first;
    ASSERT_TRUE(list >> first);
    EXPECT_EQ(ReadNames(folder / "bundle.out.names.txt").at(first), "alice/trip 1 0.png");
    EXPECT_EQ(std::count(std::istreambuf_iterator<char>(list), {}, ' '), 0);
  }
}

// VisualSFM's documentation, "NVM format".
TEST(ReadBack, NvmProjectsWhereThePhotosShowIt) {
  for (const Lens& lens : {kSimpleRadial, Lens{"SIMPLE_RADIAL", {500, 320, 240, 0.05}},
                           Lens{"SIMPLE_PINHOLE", {500, 320, 240}}}) {
    const Scene scene({lens}, "alice/trip 1 ");
    const TestFolder folder;
    const Status written = WriteModel(scene.model(), "nvm", folder.path());
    ASSERT_TRUE(written.ok()) << written.error();
    std::ifstream in(folder / "model.nvm");
    std::string word;
    in >> word;
    EXPECT_EQ(word, "NVM_V3");
    struct Camera {
      std::string name;
      double f, r;
      Eigen::Quaterniond q;
      Vector3d centre;
    };
    size_t num_cameras = 0, num_points = 0;
    in >> num_cameras;
    ASSERT_EQ(num_cameras, 4u);
    std::vector<Camera> cameras(num_cameras);
    for (Camera& camera : cameras) {
      int zero = 1;
      in >> camera.name >> camera.f >> camera.q.w() >> camera.q.x() >> camera.q.y() >>
          camera.q.z() >> camera.centre[0] >> camera.centre[1] >> camera.centre[2] >> camera.r >>
          zero;
      EXPECT_EQ(zero, 0);
    }
    in >> num_points;
    ASSERT_EQ(num_points, scene.points().size());
    std::vector<Vector3d> points;
    for (size_t p = 0; p < num_points; ++p) {
      Vector3d point;
      int red, green, blue;
      size_t count;
      in >> point[0] >> point[1] >> point[2] >> red >> green >> blue >> count;
      points.push_back(point);
      EXPECT_EQ(count, 4u);
      for (size_t v = 0; v < count; ++v) {
        size_t index, feature;
        Vector2d m;
        in >> index >> feature >> m[0] >> m[1];
        const Camera& camera = cameras.at(index);
        const Vector3d P = camera.q * (point - camera.centre);
        m /= camera.f;
        const Vector2d undistorted = (1 + camera.r * m.squaredNorm()) * m;
        EXPECT_LT(camera.f * (undistorted - Vector2d(P.x() / P.z(), P.y() / P.z())).norm(),
                  kMaxNvmError * kWidth);
      }
    }
    size_t next_model = 1;
    in >> next_model;
    EXPECT_TRUE(in);
    EXPECT_EQ(next_model, 0u);
    ExpectPoints(points, scene.points());
    EXPECT_EQ(cameras[0].name, "alice/trip_1_0.png");
    EXPECT_EQ(ReadNames(folder / "model.nvm.names.txt").at(cameras[3].name), "alice/trip 1 3.png");
  }
}

TEST(ReadBack, NvmAndBundlerRefuseCamerasThatTheyCannotHold) {
  const TestFolder folder;
  const auto refused = [&](const char* format, const Lens& lens) {
    return WriteModel(Scene({lens}).model(), format, folder.path()).error();
  };
  for (const char* format : {"nvm", "bundler"}) {
    EXPECT_NE(refused(format, kFisheye).find("OPENCV_FISHEYE"), std::string::npos);
    EXPECT_NE(refused(format, {"SIMPLE_PINHOLE", {500, 300, 240}}).find("20 px from the middle"),
              std::string::npos);
  }
  EXPECT_NE(refused("nvm", {"RADIAL", {500, 320, 240, -0.1, 0.02}}).find("RADIAL"),
            std::string::npos);
  EXPECT_NE(refused("nvm", {"SIMPLE_RADIAL", {500, 320, 240, -0.15}}).find("off by"),
            std::string::npos);
  EXPECT_NE(refused("nvm", {"SIMPLE_RADIAL", {250, 320, 240, -0.4}}).find("turns back"),
            std::string::npos);
}

TEST(ReadBack, ColmapModelsAreWhatTheyWere) {
  const Scene scene({kSimpleRadial}, "alice/trip 1 ");
  const TestFolder folder;
  ASSERT_TRUE(WriteModel(scene.model(), "bin", folder.path()).ok());
  const ColmapModel binary = ReadColmapBinary(folder.path());
  ExpectSmallResiduals(binary, 1e-6);
  EXPECT_EQ(binary.cameras.at(1).params, kSimpleRadial.params);
  ASSERT_EQ(binary.photos.size(), 4u);
  const TestFolder text_folder;
  ASSERT_TRUE(WriteModel(scene.model(), "text", text_folder.path()).ok());
  const ColmapModel text = ReadColmapText(text_folder.path());
  ExpectSmallResiduals(text, 1e-6);
  ASSERT_EQ(text.photos.size(), 4u);
  const auto names = ReadNames(text_folder / "text.names.txt");
  for (const ColmapPhoto& photo : text.photos) {
    EXPECT_EQ(std::count_if(binary.photos.begin(), binary.photos.end(),
                            [&](const ColmapPhoto& b) { return b.name == names.at(photo.name); }),
              1);
  }
  ASSERT_TRUE(WriteModel(scene.model(), "ply", folder.path()).ok());
  const Ply ply = ReadPly(folder / "points.ply");
  ExpectPoints(ply.points, scene.points());
  EXPECT_EQ(ply.colours.at(0)[1], 100);
  EXPECT_EQ(ply.colours.at(0)[2], 200);
}

TEST(WrittenNames, AreToldApart) {
  const Scene scene({kSimpleRadial});
  Reconstruction model = scene.model();
  const char* names[] = {"a/b c.png", "a/b_c.png", "a/b\tc.png", "a_b/c.jpg"};
  for (int i = 0; i < 4; ++i) model.Image(static_cast<ImageId>(i + 1)).SetName(names[i]);
  EXPECT_EQ(NumNamesWithBlanks(model), 2);
  EXPECT_EQ(
      NamesWithoutBlanks(model),
      (WrittenNames{{1, "a/b_c~2.png"}, {2, "a/b_c.png"}, {3, "a/b_c~3.png"}, {4, "a_b/c.jpg"}}));
  EXPECT_EQ(
      FlatNames(model, ".jpg"),
      (WrittenNames{{1, "a_b_c.jpg"}, {2, "a_b_c~2.jpg"}, {3, "a_b_c~3.jpg"}, {4, "a_b_c~4.jpg"}}));
}

TEST(WrittenNames, LongOnesAreCutBetweenCharacters) {
  const Scene scene({kSimpleRadial});
  Reconstruction model = scene.model();
  std::string umlauts = "a/";
  for (int i = 0; i < 125; ++i) umlauts += "\u00fc";
  for (const ImageId id : model.RegImageIds()) {
    model.Image(id).SetName(umlauts + std::to_string(id) + ".jpg");
  }
  const WrittenNames names = FlatNames(model, ".png");
  std::string flat = "a_";
  for (int i = 0; i < 99; ++i) flat += "\u00fc";
  EXPECT_EQ(names.at(1), flat + ".png");
  EXPECT_EQ(names.at(2), flat + "~2.png");
}

TEST(ReadBack, TrainingFoldersSayWhatIsMissing) {
  const Scene scene({kSimpleRadial});
  const TestFolder folder;
  const auto error = [&](const PhotoSource& photos) {
    return WriteTrainingFolder(
               scene.model(), {kNerfstudio}, photos, [] {}, folder.path())
        .error();
  };
  EXPECT_EQ(
      error([](const std::string& name) -> Result<cv::Mat3b> { return NotFound("no " + name); }),
      "no alice/0.png");
  EXPECT_EQ(error([](const std::string&) -> Result<cv::Mat3b> { return cv::Mat3b(10, 20); }),
            "photo alice/0.png has 20 x 10 pixels, its camera in the model 640 x 480");
}

// Of 12 GB, for a camera of which the file alone tells.
TEST(ReadBack, NoMemoryIsTakenForACameraWhosePhotosHaveAnotherSize) {
  Reconstruction model = Scene({kSimpleRadial}).model();
  Camera& camera = model.Camera(model.Image(model.RegImageIds().front()).CameraId());
  camera.InitializeWithName("SIMPLE_RADIAL", 40'000, 40'000, 40'000);
  camera.SetParams({40'000, 20'000, 20'000, -5});  // its distortion has borders
  const TestFolder folder;
  const Status written = WriteTrainingFolder(
      model, {kNerfstudio}, [](const std::string&) { return cv::Mat3b(480, 640); }, [] {},
      folder.path());
  EXPECT_NE(written.error().find("640 x 480 pixels, its camera in the model 40000 x 40000"),
            std::string::npos)
      << written.error();
}

}  // namespace skein::read_back_test
