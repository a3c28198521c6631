#include "benchmark/support/synthetic_pool.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "benchmark/support/dense_cloud.h"
#include "benchmark/support/point_grid.h"
#include "benchmark/support/surface_distance.h"
#include "clients/places/random.h"
#include "clients/places/truth.h"
#include "core/statistics.h"
#include "testing/test_folder.h"

namespace skein::synthetic_pool_test {

// Eight stations along façades, 32 photos.
SyntheticPoolOptions SmallPool(const TestFolder& cache) {
  SyntheticPoolOptions options;
  options.scenario.scenario = sim::Scenario::kDisjoint;
  options.scenario.agents = 1;
  options.scenario.photos = 8;
  options.width = 200;
  options.height = 150;
  options.cache = cache.path().string();
  return options;
}

std::vector<int> FirstWalk() { return {0, 1, 2, 3, 4, 5, 6, 7}; }

SurfaceDistance DistanceToTruth(const SyntheticPool& pool, const TestFolder& folder) {
  const std::string file = (folder / "surfaces.ply").string();
  sim::WriteSurfaces(file, pool.place().scene);
  return SurfaceDistance(file);
}

TEST(SyntheticPool, PointsOfAMapAndDenseOnesLieNearTheTrueSurface) {
  const TestFolder cache;
  const SyntheticPool pool(SmallPool(cache));
  const SurfaceDistance distance = DistanceToTruth(pool, cache);
  const PoolMap map = pool.MapOf(FirstWalk());
  ASSERT_EQ(map.map.photos.size(), 8u);
  ASSERT_GT(map.map.points.size(), 500u);
  std::vector<double> errors;
  for (const GuidedPoint& point : map.map.points) {
    ASSERT_GE(point.photos.size(), 2u);
    ASSERT_TRUE(std::is_sorted(point.photos.begin(), point.photos.end()));
    errors.push_back(distance(point.xyz));
  }
  // At some 8 m a pixel is 5 cm wide; parallax is 7 degrees from photo to photo.
  EXPECT_LT(percentile(errors, 50), 0.15);
  EXPECT_GT(percentile(errors, 50), 1e-4) << "points have no noise";
  EXPECT_NEAR(mean(map.error_px), 0.5, 0.3);

  DenseCloud cloud(pool, 2);
  const std::vector<Eigen::Vector3d> points = cloud.Make(map);
  ASSERT_GT(points.size(), 1000u);
  std::vector<double> dense_errors;
  for (size_t i = 0; i < points.size(); i += 20) dense_errors.push_back(distance(points[i]));
  EXPECT_LT(percentile(dense_errors, 50), 0.15);
  EXPECT_EQ(cloud.Make(map).size(), points.size()) << "from depth maps that were kept";
  EXPECT_LT(cloud.Make(pool.MapOf({0, 1, 2, 3})).size(), points.size());
}

TEST(SyntheticPool, APhotoRegistersWhenThoseBetweenHave) {
  const TestFolder cache;
  const SyntheticPool pool(SmallPool(cache));
  ASSERT_EQ(pool.size(), 32) << "each station in four ways";
  EXPECT_EQ(pool.photo(0).agent, 0);
  EXPECT_EQ(pool.photo(31).agent, 3);
  EXPECT_EQ(pool.Registered({0, 1, 7}), (std::vector<int>{0, 1}));
  const std::vector<int> all = pool.Registered({0, 1, 7, 2, 3, 4, 5, 6});
  EXPECT_EQ(all.size(), 8u);
  EXPECT_GT(std::find(all.begin(), all.end(), 7), std::find(all.begin(), all.end(), 3))
      << "it is tried again once others have registered";
  EXPECT_GT(pool.CommonPoints(2, {0, 1}), pool.CommonPoints(7, {0, 1}));
}

TEST(SyntheticPool, AnAddedPhotoIsAsOneThatWasPlanned) {
  const TestFolder cache;
  SyntheticPool pool(SmallPool(cache));
  const int planned = pool.CommonPoints(2, {0, 1});
  const int added = pool.Add(pool.photo(2).cam_from_world, 5);
  EXPECT_EQ(added, 32);
  EXPECT_EQ(pool.photo(added).agent, 5);
  EXPECT_NEAR(cv::mean(cv::abs(pool.grey(added) - pool.grey(2)))[0], 0, 5) << "but for noise";
  // Corners of the added one are points, too.
  EXPECT_GT(pool.CommonPoints(added, {0, 1}), 0.7 * planned);
  EXPECT_LT(pool.CommonPoints(added, {0, 1}), 2.0 * planned);
  EXPECT_EQ(pool.Registered({0, 1, added}), (std::vector<int>{0, 1, added}));
}

TEST(PointGrid, FindsWhatIsWithinTheRadius) {
  sim::Random random(5);
  const auto drawn = [&] {
    return Eigen::Vector3d(random.Uniform(-2, 2), random.Uniform(-2, 2), random.Uniform(-2, 2));
  };
  std::vector<Eigen::Vector3d> points;
  PointGrid grid(0.3);
  for (uint32_t i = 0; i < 2000; ++i) {
    points.push_back(drawn());
    grid.Add(points.back(), i);
  }
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector3d center = drawn();
    const auto near = [&](const Eigen::Vector3d& p) { return (p - center).norm() <= 0.4; };
    const auto expected = std::count_if(points.begin(), points.end(), near);
    int found = 0;
    grid.ForNear(center, 0.4, [&](uint32_t index, const Eigen::Vector3d& p) {
      found += near(p) && p == points[index];
      return true;
    });
    EXPECT_EQ(found, expected);
    EXPECT_EQ(grid.AnyNear(center, 0.4), expected > 0);
  }
}

}  // namespace skein::synthetic_pool_test
