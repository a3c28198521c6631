#include "benchmark/support/model_pool.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "sfm/model_files.h"
#include "testing/synthetic_scene.h"
#include "testing/test_folder.h"

namespace skein::model_pool_test {

// Twelve photos of a wall, with a bright spot at each keypoint. Of two cameras, with distortion.
class ModelPoolTest : public testing::Test {
 protected:
  static SyntheticOptions Options() {
    SyntheticOptions options;
    options.shape = SyntheticOptions::Shape::kWall;
    options.num_photos = 12;
    options.num_points = 1500;
    options.second_camera_from = 7;
    options.camera.distortion = 0.05;
    return options;
  }

  ModelPoolTest() {
    const SyntheticScene scene = MakeScene(Options());
    SceneMap map;
    FillMap(scene, &map);
    model_ = map.reconstruction();
    for (const auto& [id, camera] : model_.Cameras()) {
      model_.Camera(id).SetParams({Options().camera.focal_px, camera.PrincipalPointX(),
                                   camera.PrincipalPointY(), Options().camera.distortion});
    }
    for (const ImageId id : model_.RegImageIds()) {
      Image& image = model_.Image(id);
      image.SetName((id < 10 ? "walk/0" : "walk/") + std::to_string(id) + ".png");
      Draw(image);
    }
    WriteModel();
  }

  void WriteModel() const {
    std::filesystem::create_directories(folder_ / "model");
    ASSERT_TRUE(WriteModelBinary(model_, folder_ / "model").ok());
  }

  void Draw(const Image& image) const {
    const Camera& camera = model_.Camera(image.CameraId());
    cv::Mat1b photo(static_cast<int>(camera.Height()), static_cast<int>(camera.Width()), 40);
    for (const Point2D& keypoint : image.Points2D()) {
      if (!keypoint.HasPoint3D()) continue;
      cv::circle(photo, cv::Point2d(keypoint.X() - 0.5, keypoint.Y() - 0.5), 4, 200, cv::FILLED);
    }
    const std::filesystem::path path = folder_.path() / "images" / image.Name();
    std::filesystem::create_directories(path.parent_path());
    cv::imwrite(path.string(), photo);
  }

  ModelPool MakePool() const {
    ModelPoolOptions options;
    options.model = (folder_ / "model").string();
    options.images = (folder_ / "images").string();
    options.width = 600;
    return ModelPool(options);
  }

  TestFolder folder_;
  Reconstruction model_;
};

TEST_F(ModelPoolTest, HasThePhotosInTheOrderOfTheirNamesWithoutDistortion) {
  const ModelPool pool = MakePool();
  ASSERT_EQ(pool.size(), 12);
  for (int i = 0; i < pool.size(); ++i) {
    EXPECT_EQ(pool.photo(i).image_id, i + 1);
    EXPECT_EQ(pool.photo(i).agent, 0);
    EXPECT_EQ(pool.grey(i).cols, 600);
    EXPECT_EQ(pool.grey(i).rows, 450);
    EXPECT_EQ(pool.camera(i).fx_px, pool.camera(i).fy_px);
    EXPECT_TRUE(pool.photo(i).texture.has_value());
  }
  EXPECT_GT(pool.num_left_out(), 0u) << "the corners of a photo with such a distortion";

  // Where a point of the map is projected to without distortion there is its spot.
  const PoolMap map = pool.MapOf({0, 1, 2});
  size_t bright = 0, all = 0;
  for (const GuidedPoint& point : map.map.points) {
    for (const uint32_t i : point.photos) {
      const GuidedPhoto& photo = map.map.photos[i];
      Eigen::Vector2d pixel;
      if (!map.map.cameras[photo.camera].Project(photo.cam_from_world.Apply(point.xyz), &pixel)) {
        continue;
      }
      ++all;
      bright +=
          pool.grey(map.taken[i])(static_cast<int>(pixel.y()), static_cast<int>(pixel.x())) > 120;
    }
  }
  ASSERT_GT(all, 300u);
  EXPECT_GT(static_cast<double>(bright) / static_cast<double>(all), 0.95);
}

TEST_F(ModelPoolTest, TheMapOfAllIsTheModel) {
  const ModelPool pool = MakePool();
  std::vector<int> all;
  for (int i = 0; i < pool.size(); ++i) all.push_back(i);
  const PoolMap map = pool.MapOf(all);
  EXPECT_LT(map.map.points.size(), pool.num_points() + 1);
  EXPECT_GT(map.map.points.size(), 0.9 * static_cast<double>(model_.NumPoints3D()))
      << "but for what lies outside";
  ASSERT_EQ(map.error_px.size(), map.map.points.size());
  double sum = 0;
  for (const double error : map.error_px) sum += error / static_cast<double>(map.error_px.size());
  EXPECT_LT(sum, 0.5) << "0.3 px of noise at twice the width";
  EXPECT_GT(sum, 0.02);
}

TEST_F(ModelPoolTest, APointNeedsTwoOfThePhotosTaken) {
  const ModelPool pool = MakePool();
  const std::vector<int> taken = {4, 2, 3};
  const PoolMap map = pool.MapOf(taken);
  EXPECT_EQ(map.taken, taken);
  ASSERT_EQ(map.map.photos.size(), 3u);
  EXPECT_EQ(map.map.photos[0].image_id, pool.photo(4).image_id);
  ASSERT_GT(map.map.points.size(), 100u);
  EXPECT_LT(map.map.points.size(), model_.NumPoints3D());
  for (const GuidedPoint& point : map.map.points) {
    ASSERT_GE(point.photos.size(), 2u);
    ASSERT_LE(point.photos.size(), 3u);
    ASSERT_TRUE(std::is_sorted(point.photos.begin(), point.photos.end()));
  }
  EXPECT_TRUE(pool.MapOf({4}).map.points.empty());
  EXPECT_TRUE(pool.MapOf({}).map.photos.empty());
}

TEST_F(ModelPoolTest, CommonPointsAreThoseThatTheMapWouldHaveWithoutThePhoto) {
  const ModelPool pool = MakePool();
  const PoolMap map = pool.MapOf({2, 3, 4});
  int seen = 0;
  const PoolMap without = pool.MapOf({2, 3});
  for (const GuidedPoint& point : without.map.points) {
    seen += std::any_of(map.map.points.begin(), map.map.points.end(), [&](const GuidedPoint& p) {
      return p.xyz == point.xyz && p.photos.back() == 2;
    });
  }
  EXPECT_EQ(pool.CommonPoints(4, {2, 3}), seen);
  EXPECT_EQ(pool.CommonPoints(4, {2, 3, 4}), seen) << "its own observations do not count";
  EXPECT_EQ(pool.CommonPoints(4, {2}), 0);
}

TEST_F(ModelPoolTest, APhotoRegistersWhenThoseBetweenHave) {
  const ModelPool pool = MakePool();
  ASSERT_LT(pool.CommonPoints(11, {0, 1}), 30);
  EXPECT_EQ(pool.Registered({0, 1, 11}), (std::vector<int>{0, 1}));
  const std::vector<int> all = pool.Registered({0, 1, 11, 2, 3, 4, 5, 6, 7, 8, 9, 10});
  EXPECT_EQ(all.size(), 12u);
}

TEST_F(ModelPoolTest, RefusesAFolderWithoutAModel) {
  std::filesystem::remove(folder_ / "model" / "points3D.bin");
  EXPECT_THROW(MakePool(), std::runtime_error);
}

TEST_F(ModelPoolTest, RefusesAPhotoThatIsMissingOrOfAnotherSize) {
  const std::string name = model_.Image(model_.RegImageIds().front()).Name();
  const std::string path = (folder_.path() / "images" / name).string();
  cv::imwrite(path, cv::Mat1b(30, 40, 100));
  EXPECT_THROW(MakePool(), std::runtime_error);
  std::filesystem::remove(path);
  EXPECT_THROW(MakePool(), std::runtime_error);
}

}  // namespace skein::model_pool_test
