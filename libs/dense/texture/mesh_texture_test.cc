#include "texture/mesh_texture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>
#include <vector>

#include "surface/model_mesh.h"
#include "testing/wall_maps.h"
#include "texture/triangle_photos.h"

namespace skein::texture_test {
namespace {

using depth_test::PoseAt;
using depth_test::Wall;

constexpr int kEnlarged = 4;  // sides of a photo over those of its depth map

// A colour at each point of the wall: smooth over a unit, darkest 60, brightest 180.
cv::Vec3d ColourAt(const Eigen::Vector3d& point) {
  return {120 + 60 * std::sin(2 * point.x()), 120 + 60 * std::sin(2 * point.y()), 120};
}

// A photo of the wall and its depth map. Exposure multiplies the colours.
struct WallView {
  explicit WallView(const DepthPose& pose, double exposure = 1)
      : map(Wall().Map(pose, 0.02f)),
        photo_camera{kEnlarged * map.camera.width, kEnlarged * map.camera.height,
                     kEnlarged * map.camera.focal_px, kEnlarged * map.camera.principal_point_px},
        colours(ColoursOf(map.camera, exposure)),
        photo(ColoursOf(photo_camera, exposure)) {}

  cv::Mat3b ColoursOf(const DepthCamera& camera, double exposure) const {
    cv::Mat3b image(camera.height, camera.width);
    for (int y = 0; y < camera.height; ++y) {
      for (int x = 0; x < camera.width; ++x) {
        const Eigen::Vector2d ray = camera.Ray({x + 0.5, y + 0.5});
        const Eigen::Vector3d in_camera = Wall().Depth(map.cam_from_world, ray) * ray.homogeneous();
        image(y, x) = exposure * ColourAt(map.cam_from_world.ToWorld(in_camera));
      }
    }
    return image;
  }

  DepthMap map;
  DepthCamera photo_camera;
  cv::Mat3b colours, photo;
};

class TextureOfWall : public testing::Test {
 protected:
  void View(const Eigen::Vector3d& centre, double exposure = 1) {
    views_.emplace_back(PoseAt(centre), exposure);
  }

  void MakeMesh() {
    for (const WallView& view : views_) maps_.push_back({&view.map, &view.colours, nullptr});
    mesh_ = MakeModelMesh(maps_, MeshOptions())->mesh;
  }

  TexturePhotos Photos() const {
    TexturePhotos photos;
    for (const WallView& view : views_) photos.cameras.push_back(view.photo_camera);
    photos.pixels = [this](size_t i) -> Result<cv::Mat3b> { return views_[i].photo; };
    return photos;
  }

  std::vector<MeshPart> Texture(const TextureOptions& options = {}) const {
    return *TextureOf(mesh_, maps_, Photos(), options);
  }

  static cv::Vec3b TextureAt(const MeshPart& part, uint32_t vertex) {
    const Eigen::Array2f pixel =
        part.places[vertex].array() * Eigen::Array2f(part.texture.cols, part.texture.rows);
    return part.texture(std::min(part.texture.rows - 1, static_cast<int>(pixel.y())),
                        std::min(part.texture.cols - 1, static_cast<int>(pixel.x())));
  }

  Eigen::Vector3d Position(uint32_t vertex) const { return mesh_.Position(mesh_.vertices[vertex]); }

  // Over all vertices with a texture, of the largest difference in a channel.
  double MeanDifference(const std::vector<MeshPart>& parts) const {
    double sum = 0;
    size_t count = 0;
    for (const MeshPart& part : parts) {
      for (uint32_t i = 0; i < part.places.size(); ++i, ++count) {
        const cv::Vec3d truth = ColourAt(Position(part.vertices[i]));
        sum += cv::norm(cv::Vec3d(TextureAt(part, i)) - truth, cv::NORM_INF);
      }
    }
    return sum / count;
  }

  std::vector<WallView> views_;
  std::vector<ColouredMap> maps_;
  SurfaceMesh mesh_;
};

size_t NumTriangles(const std::vector<MeshPart>& parts) {
  size_t sum = 0;
  for (const MeshPart& part : parts) sum += part.indices.size() / 3;
  return sum;
}

TEST_F(TextureOfWall, EachVertexLiesWhereItsPhotoShowsIt) {
  View({0, 0, 0});
  View({1.5, 0.3, 0});
  MakeMesh();
  const std::vector<MeshPart> parts = Texture();
  ASSERT_FALSE(parts.empty());
  EXPECT_FALSE(parts[0].texture.empty());
  EXPECT_EQ(NumTriangles(parts), static_cast<size_t>(mesh_.NumTriangles()));
  EXPECT_LT(MeanDifference(parts), 3);
}

TEST_F(TextureOfWall, SeamsAreFew) {
  View({0, 0, 0});
  View({1.5, 0.3, 0});
  MakeMesh();
  const std::vector<int32_t> neighbours = NeighboursOf(mesh_);
  const std::vector<int32_t> photos = ChoosePhotos(ViewsOf(mesh_, maps_, 1), neighbours);
  EXPECT_EQ((std::set<int32_t>(photos.begin(), photos.end())), (std::set<int32_t>{0, 1, -1}))
      << "the mesh's border lies on the border of the maps";
  size_t num_seams = 0;
  for (size_t i = 0; i < neighbours.size(); ++i) {
    const int32_t here = photos[i / 3];
    num_seams += neighbours[i] >= 0 && here >= 0 && photos[neighbours[i]] == 1 - here;
  }
  EXPECT_LT(num_seams, 8 * std::sqrt(mesh_.NumTriangles())) << "one line across the wall";
}

TEST_F(TextureOfWall, NeighboursShareASide) {
  View({0, 0, 0});
  View({1.5, 0.3, 0});
  MakeMesh();
  const std::vector<int32_t> neighbours = NeighboursOf(mesh_);
  size_t num_none = 0;
  for (size_t i = 0; i < neighbours.size(); ++i) {
    num_none += neighbours[i] < 0;
    if (neighbours[i] < 0) continue;
    const uint32_t* there = &mesh_.indices[3 * static_cast<size_t>(neighbours[i])];
    for (const size_t corner : {i, i % 3 == 2 ? i - 2 : i + 1}) {
      EXPECT_EQ(std::count(there, there + 3, mesh_.indices[corner]), 1);
    }
  }
  EXPECT_LT(num_none, neighbours.size() / 20) << "the border";
}

TEST_F(TextureOfWall, ExposuresAreMadeEqual) {
  View({0, 0, 0}, 1.2);
  View({1.5, 0.3, 0}, 1 / 1.2);
  MakeMesh();
  EXPECT_LT(MeanDifference(Texture()), 4) << "20 of 120 without gains";
}

TEST_F(TextureOfWall, AMaskedPhotoGivesNoTexture) {
  View({0, 0, 0});
  View({1.5, 0.3, 0});
  MakeMesh();
  const cv::Mat1b masked(views_[0].map.depth.size(), 0);
  for (ColouredMap& map : maps_) map.mask = &masked;
  const std::vector<MeshPart> parts = Texture();
  ASSERT_EQ(parts.size(), 1U);
  EXPECT_TRUE(parts[0].texture.empty());
  EXPECT_TRUE(parts[0].places.empty());
  EXPECT_EQ(parts[0].indices.size(), mesh_.indices.size());
}

TEST_F(TextureOfWall, ManyPixelsAreReduced) {
  View({0, 0, 0});
  View({1.5, 0.3, 0});
  MakeMesh();
  TextureOptions options;
  options.max_pixels = 40'000;
  const std::vector<MeshPart> parts = Texture(options);
  EXPECT_LT(parts[0].texture.total(), 80'000U);
  EXPECT_GT(parts[0].texture.total(), 30'000U);
  EXPECT_LT(MeanDifference(parts), 5);
}

TEST_F(TextureOfWall, ChartsThatDontFitOnePageGoOnMore) {
  View({0, 0, 0});
  View({3, 0.3, 0});
  View({6, 0.3, 0});
  MakeMesh();
  TextureOptions options;
  options.page_px = 650;  // a photo is 640 pixels wide
  const std::vector<MeshPart> parts = Texture(options);
  ASSERT_GT(parts.size(), 2U);
  for (const MeshPart& part : parts) {
    EXPECT_LE(std::max(part.texture.cols, part.texture.rows), options.page_px);
    for (const Eigen::Vector2f& place : part.places) {
      EXPECT_GE(place.minCoeff(), 0);
      EXPECT_LE(place.maxCoeff(), 1);
    }
  }
  EXPECT_EQ(NumTriangles(parts), static_cast<size_t>(mesh_.NumTriangles()));
  EXPECT_LT(MeanDifference(parts), 4);
}

TEST_F(TextureOfWall, APhotoThatCannotBeReadIsTold) {
  View({0, 0, 0});
  View({1.5, 0.3, 0});
  MakeMesh();
  TexturePhotos photos = Photos();
  photos.pixels = [](size_t) -> Result<cv::Mat3b> { return NotFound("no photo"); };
  EXPECT_EQ(TextureOf(mesh_, maps_, photos).error(), "no photo");
  photos.cameras.pop_back();
  EXPECT_THROW((void)TextureOf(mesh_, maps_, photos), std::invalid_argument);
}

}  // namespace
}  // namespace skein::texture_test
