#include "clients/export/dense_folder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "core/file.h"
#include "testing/test_folder.h"
#include "testing/test_tiff.h"
#include "testing/wall_photos.h"

namespace skein::dense_folder_test {

using depth_test::kWallHeight;
using depth_test::kWallWidth;
using depth_test::PoseAt;
using depth_test::Wall;

const std::vector<DepthPose> kPoses = {PoseAt({0, 0, 0}), PoseAt({1.2, 0, 0}), PoseAt({0, 1.2, 0}),
                                       PoseAt({1.2, 1.2, 0}, 0, 0.4)};

std::string NameOf(size_t i) { return "alice/wall " + std::to_string(i) + ".jpg"; }

void AddPhoto(size_t i, Reconstruction* model) {
  Image image;
  image.SetImageId(static_cast<ImageId>(i + 1));
  image.SetCameraId(1);
  image.SetName(NameOf(i));
  const Eigen::Quaterniond q(kPoses[i].rotation);
  image.SetQvec({q.w(), q.x(), q.y(), q.z()});
  image.SetTvec(kPoses[i].translation);
  image.SetPoints2D(std::vector<Eigen::Vector2d>(100, Eigen::Vector2d(80, 60)));
  model->AddImage(image);
  model->RegisterImage(image.ImageId());
}

// All photos observe a hundred points of the wall.
Reconstruction WallModel() {
  Reconstruction model;
  Camera camera;
  camera.SetCameraId(1);
  camera.SetModelIdFromName("PINHOLE");
  camera.SetWidth(kWallWidth);
  camera.SetHeight(kWallHeight);
  camera.SetParams({150, 150, 80, 60});
  model.AddCamera(camera);
  for (size_t i = 0; i < kPoses.size(); ++i) AddPhoto(i, &model);
  for (int p = 0; p < 100; ++p) {
    const double x = -5 + 1.2 * (p % 10), y = -4 + 0.9 * (p / 10);
    Track track;
    for (size_t i = 0; i < kPoses.size(); ++i) track.AddElement(static_cast<ImageId>(i + 1), p);
    model.AddPoint3D({x, y, Wall().distance + Wall().slope * x}, track);
  }
  return model;
}

Result<cv::Mat3b> Photo(const std::string& name) {
  for (size_t i = 0; i < kPoses.size(); ++i) {
    if (NameOf(i) != name) continue;
    cv::Mat3b photo;
    cv::merge(std::vector<cv::Mat>(3, Wall().Photo(kPoses[i]).grey), photo);
    return photo;
  }
  return NotFound("no photo " + name);
}

class DenseFolderTest : public testing::Test {
 protected:
  Result<DenseFigures> Write(const std::set<std::string>& formats, const PhotoSource& photos) {
    DenseOptions options;
    options.formats = formats;
    options.origin = GeodeticPosition{47, 8, 500.0};
    return WriteDenseFolder(
        WallModel(), options, photos, [] {}, folder_.path());
  }

  nlohmann::json ReadJson(const std::string& file) const {
    return nlohmann::json::parse(*ReadFile((folder_.path() / file).string()));
  }

  cv::Mat ReadTiff(const std::string& file) const {
    return cv::imread((folder_.path() / file).string(), cv::IMREAD_UNCHANGED);
  }

  TestFolder folder_;
};

TEST_F(DenseFolderTest, TheWallComesOnce) {
  const Result<DenseFigures> figures = Write({kDense}, Photo);
  ASSERT_TRUE(figures.ok()) << figures.error();
  EXPECT_GT(figures->quality.completeness, 0.5);
  EXPECT_GT(figures->num_points, kWallWidth * kWallHeight / 2);
  EXPECT_LT(figures->num_points, 2 * kWallWidth * kWallHeight) << "four photos show it";
  const Bytes ply = *ReadFile((folder_.path() / "dense.ply").string());
  constexpr size_t kVertexBytes = 6 * sizeof(float) + 3;
  const size_t body = kVertexBytes * figures->num_points;
  ASSERT_GT(ply.size(), body);
  int num_off = 0;
  for (size_t at = ply.size() - body; at < ply.size(); at += kVertexBytes) {
    float v[6];
    std::memcpy(v, ply.data() + at, sizeof(v));
    num_off += std::abs(v[2] - (Wall().distance + Wall().slope * v[0])) > 0.1;  // 1 %
  }
  EXPECT_LT(num_off, figures->num_points / 50);
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "depth"));
}

TEST_F(DenseFolderTest, DepthMapsComeWithTheirCameras) {
  ASSERT_TRUE(Write({kDepth}, Photo).ok());
  const auto folder = folder_.path() / "depth";
  const auto cameras = nlohmann::json::parse(*ReadFile((folder / "cameras.json").string()));
  ASSERT_EQ(cameras["photos"].size(), kPoses.size());
  const auto& first = cameras["photos"][0];
  EXPECT_EQ(first["name"], NameOf(0));
  EXPECT_EQ(first["fx"], 150);
  const std::string file = (folder / first["file"].get<std::string>()).string();
  const cv::Mat1f depth = cv::imread(file + ".pfm", cv::IMREAD_UNCHANGED);
  const cv::Mat error = cv::imread(file + ".error.pfm", cv::IMREAD_UNCHANGED);
  const cv::Mat1w levels = cv::imread(file + ".png", cv::IMREAD_UNCHANGED);
  ASSERT_EQ(depth.size(), cv::Size(kWallWidth, kWallHeight));
  ASSERT_EQ(error.size(), depth.size());
  ASSERT_EQ(levels.size(), depth.size());
  EXPECT_NEAR(depth(60, 80), 10, 0.05);
  EXPECT_EQ(first["depths"]["agreed"], cv::countNonZero(depth));
  EXPECT_GE(first["depths"]["contradicted"].get<int64_t>(), 0);
  EXPECT_GE(first["depths"]["alone"].get<int64_t>(), 0);
  EXPECT_NEAR(levels(60, 80) * first["png_scale"].get<double>(), depth(60, 80), 1e-3);
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "dense.ply"));
}

TEST_F(DenseFolderTest, EachPhotoHasAMaskOfItsNameAndSize) {
  DenseOptions options;
  options.formats = {kDepth};
  options.size_px = kWallWidth / 2;
  ASSERT_TRUE(WriteDenseFolder(
                  WallModel(), options, Photo, [] {}, folder_.path())
                  .ok());
  const nlohmann::json cameras = ReadJson("depth/cameras.json");
  for (size_t i = 0; i < kPoses.size(); ++i) {
    const std::string name = "masks/" + NameOf(i) + ".png";
    EXPECT_EQ(cameras["photos"][i]["mask"], name);
    const cv::Mat mask =
        cv::imread((folder_.path() / "depth" / name).string(), cv::IMREAD_UNCHANGED);
    ASSERT_EQ(mask.type(), CV_8UC1);
    ASSERT_EQ(mask.size(), cv::Size(kWallWidth, kWallHeight));
    const int64_t num_black = static_cast<int64_t>(mask.total()) - cv::countNonZero(mask);
    EXPECT_EQ(num_black, 4 * cameras["photos"][i]["depths"]["contradicted"].get<int64_t>());
    EXPECT_EQ(cv::countNonZero(mask == 255), cv::countNonZero(mask));
  }
}

// Agents choose names: of one photo the mask's name is too long, of two others it is a folder's.
TEST_F(DenseFolderTest, NoNameOfAPhotoHoldsUpTheOthers) {
  Reconstruction model = WallModel();
  const std::string long_name = "mallory/" + std::string(250, 'x') + ".jpg";
  const std::vector<std::string> names = {"mallory/a", "mallory/a.png/b", long_name, NameOf(3)};
  for (size_t i = 0; i < names.size(); ++i) {
    model.Image(static_cast<ImageId>(i + 1)).SetName(names[i]);
  }
  const auto photo = [&](const std::string& name) {
    const auto found = std::find(names.begin(), names.end(), name);
    return Photo(NameOf(static_cast<size_t>(found - names.begin())));
  };
  DenseOptions options;
  options.formats = {kDepth};
  const Result<DenseFigures> figures = WriteDenseFolder(
      model, options, photo, [] {}, folder_.path());
  ASSERT_TRUE(figures.ok()) << figures.error();
  const nlohmann::json cameras = ReadJson("depth/cameras.json");
  for (const nlohmann::json& each : cameras["photos"]) {
    const auto mask = folder_.path() / "depth" / each["mask"].get<std::string>();
    EXPECT_TRUE(std::filesystem::is_regular_file(mask)) << each["name"];
  }
}

// The wall as ground: seen along z, its height is 10 + 0.3 x.
TEST_F(DenseFolderTest, AnOrthophotoHasColoursAndHeights) {
  const Result<DenseFigures> figures = Write({kOrthophoto}, Photo);
  ASSERT_TRUE(figures.ok()) << figures.error();
  EXPECT_NEAR(figures->cell, 10 / 150.0, 0.005);
  EXPECT_GT(figures->grid_completeness, 0.8);
  const cv::Mat4b colours = ReadTiff("orthophoto.tif");
  const cv::Mat1f heights = ReadTiff("elevation.tif");
  ASSERT_FALSE(colours.empty());
  ASSERT_EQ(colours.size(), heights.size());
  const int row = heights.rows / 2;
  const float left = heights(row, heights.cols / 4), right = heights(row, 3 * heights.cols / 4);
  EXPECT_NEAR((right - left) / (figures->cell * (3 * heights.cols / 4 - heights.cols / 4)), 0.3,
              0.02);
  EXPECT_NEAR(left, 510, 2);
  EXPECT_EQ(colours(row, heights.cols / 4)[3], 255);
  EXPECT_EQ(ReadTiff("hillshade.tif").size(), heights.size());
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "orthophoto.tfw"));
  const nlohmann::json json = ReadJson("orthophoto.json");
  EXPECT_EQ(json["unit"], "m");
  EXPECT_EQ(json["up"], "GPS");
  EXPECT_EQ(json["columns"], heights.cols);
  EXPECT_TRUE(json["ground_share"].is_null());
}

// Without GPS the wall is the ground plane, seen from above: level and at 0.
TEST_F(DenseFolderTest, AnOrthophotoWithoutGpsIsLevelAndInTheModelsUnit) {
  DenseOptions options;
  options.formats = {kOrthophoto};
  const Result<DenseFigures> figures = WriteDenseFolder(
      WallModel(), options, Photo, [] {}, folder_.path());
  ASSERT_TRUE(figures.ok()) << figures.error();
  EXPECT_EQ(figures->up, "ground plane");
  const cv::Mat1f heights = ReadTiff("elevation.tif");
  const cv::Mat1b known = heights == heights, off = known & (cv::abs(heights) > 0.1);  // 1 %
  EXPECT_GT(cv::countNonZero(known), static_cast<int>(heights.total()) / 2);
  EXPECT_LT(cv::countNonZero(off), cv::countNonZero(known) / 50);
  for (const char* file : {"orthophoto.tfw", "elevation.tfw", "hillshade.tfw"}) {
    EXPECT_TRUE(std::filesystem::exists(folder_.path() / file)) << file;
  }
  const nlohmann::json json = ReadJson("orthophoto.json");
  EXPECT_EQ(json["unit"], "model");
  EXPECT_EQ(json["heights_above"], "ground plane");
  EXPECT_GT(json["ground_share"], 0.8);
  EXPECT_EQ(json["cell"], figures->cell);
  const auto& up = json["level_from_model"]["rotation"][2];
  EXPECT_NEAR(up[2].get<double>(), -1 / std::hypot(1, Wall().slope), 0.01) << "to the cameras";
}

TEST_F(DenseFolderTest, LasHoldsThePoints) {
  const Result<DenseFigures> figures = Write({kLas}, Photo);
  ASSERT_TRUE(figures.ok()) << figures.error();
  const Bytes las = *ReadFile((folder_.path() / "dense.las").string());
  uint32_t num_points = 0;
  ASSERT_GT(las.size(), 227U);
  std::memcpy(&num_points, las.data() + 107, sizeof(num_points));
  EXPECT_EQ(num_points, figures->num_points);
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "dense.ply"));
}

TEST_F(DenseFolderTest, TheMeshIsTheWall) {
  const Result<DenseFigures> figures = Write({kMesh}, Photo);
  ASSERT_TRUE(figures.ok()) << figures.error();
  EXPECT_GT(figures->num_triangles, kWallWidth * kWallHeight / 2);
  EXPECT_GT(figures->num_textured, figures->num_triangles * 9 / 10);
  EXPECT_EQ(figures->quality.mesh_voxel, figures->quality.ground_sampling_distance);
  const Bytes ply = *ReadFile((folder_.path() / "mesh.ply").string());
  const Bytes glb = *ReadFile((folder_.path() / "mesh.glb").string());
  EXPECT_EQ(std::memcmp(glb.data(), "glTF", 4), 0);
  constexpr size_t kVertexBytes = 6 * sizeof(float) + 3, kFaceBytes = 1 + 3 * sizeof(int32_t);
  const std::string text(ply.begin(), ply.begin() + 200), key = "element vertex ";
  const size_t num_vertices = std::stoul(text.substr(text.find(key) + key.size()));
  size_t at = ply.size() - kFaceBytes * figures->num_triangles - kVertexBytes * num_vertices;
  size_t num_off = 0;
  for (size_t i = 0; i < num_vertices; ++i, at += kVertexBytes) {
    float v[3];
    std::memcpy(v, ply.data() + at, sizeof(v));
    num_off += std::abs(v[2] - (Wall().distance + Wall().slope * v[0])) > 0.1;  // 1 %
  }
  EXPECT_LT(num_off, num_vertices / 50);
}

TEST_F(DenseFolderTest, TheMeshKeepsItsBudget) {
  DenseOptions options;
  options.formats = {kMesh};
  options.mesh_triangles = 2000;
  const Result<DenseFigures> figures = WriteDenseFolder(
      WallModel(), options, Photo, [] {}, folder_.path());
  ASSERT_TRUE(figures.ok()) << figures.error();
  EXPECT_LE(figures->num_triangles, 2000);
  EXPECT_GT(figures->num_triangles, 500);
  EXPECT_GT(figures->quality.mesh_voxel, figures->quality.ground_sampling_distance);
}

TEST_F(DenseFolderTest, QualityIsToldWithTheSurface) {
  const Result<DenseFigures> figures = Write({kDepth, kMesh, kOrthophoto}, Photo);
  ASSERT_TRUE(figures.ok()) << figures.error();
  const nlohmann::json surface = ReadJson("surface.json");
  const nlohmann::json cameras = ReadJson("depth/cameras.json");
  EXPECT_EQ(surface, ToJson(figures->quality));
  EXPECT_EQ(surface["photos"], kPoses.size());
  EXPECT_EQ(surface["unit"], "m");
  int64_t depths = 0;
  for (const auto& photo : cameras["photos"]) {
    for (const auto& count : photo["depths"]) depths += count.get<int64_t>();
  }
  EXPECT_EQ(surface["depths"], depths);
  EXPECT_GT(surface["agreed"], 0.5);
  EXPECT_GT(surface["expected_error_p50"], 0);
  EXPECT_GE(surface["expected_error_p95"], surface["expected_error_p50"]);
  EXPECT_LT(surface["expected_error_p95"], 1) << "of 10 m";
  EXPECT_NEAR(surface["ground_sampling_distance"].get<double>(), 10 / 150.0, 0.005);
  EXPECT_GT(surface["mesh_voxel"], 0);
  constexpr uint16_t kGdalMetadata = 42112;
  for (const char* file : {"orthophoto.tif", "elevation.tif", "hillshade.tif"}) {
    const std::string metadata = TiffText(folder_.path() / file, kGdalMetadata);
    for (const auto& [name, value] : TextsOf(figures->quality)) {
      EXPECT_NE(metadata.find("<Item name=\"" + name + "\">" + value + "</Item>"),
                std::string::npos)
          << file << ": " << metadata;
    }
  }
}

TEST_F(DenseFolderTest, APhotoThatIsMissingOrOfAnotherSizeIsTold) {
  const auto missing = Write({kDense}, [](const std::string& name) -> Result<cv::Mat3b> {
    return NotFound("no photo " + name);
  });
  EXPECT_NE(missing.error().find(NameOf(0)), std::string::npos) << missing.error();
  const auto small = Write({kDense}, [](const std::string&) -> Result<cv::Mat3b> {
    return cv::Mat3b(60, 80, cv::Vec3b());
  });
  EXPECT_EQ(small.error(),
            "photo " + NameOf(0) + " has 80 x 60 pixels, its camera in the model 160 x 120");
}

}  // namespace skein::dense_folder_test
