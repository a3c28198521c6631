#include "disambiguation/look_alike.h"

#include <gtest/gtest.h>

#include <random>

namespace skein {
namespace {

constexpr double kFocalPx = 1000;
constexpr double kDistance = 8;  // of the cameras from the façade
constexpr int kNumFirst = 7, kNumSecond = 6;

// Photos along a façade at z = 0. Its left part is the same for all. On its right, the first photos
// see points that the second ones don't; these see others there.
class Street {
 public:
  // `right_distance`: of what the second photos see on the right.
  explicit Street(double right_distance, bool second_sees_the_same = false) : random_(1) {
    AddPhotos();
    AddPoints(300, -3, 0, 0, true, true);
    AddPoints(500, 0, 5, 0, true, second_sees_the_same);
    if (!second_sees_the_same) AddPoints(500, 0, 5, kDistance - right_distance, false, true);
    Connect();
  }

  SceneMap& map() { return map_; }

  void Register(int num_photos) {
    colmap::Reconstruction& model = map_.reconstruction();
    for (int i = 0; i < num_photos; ++i) {
      model.Image(i + 1).SetQvec({1, 0, 0, 0});
      model.Image(i + 1).SetTvec(-centers_[i]);
      map_.Register(i + 1);
    }
    for (size_t p = 0; p < points_.size(); ++p) {
      colmap::Track track;
      for (int i = 0; i < num_photos; ++i) {
        if (keypoint_[i][p] >= 0) track.AddElement(i + 1, keypoint_[i][p]);
      }
      if (track.Length() >= 2) model.AddPoint3D(points_[p], track);
    }
  }

  CellVotes CompareSecond(int photo) {
    colmap::Image image = map_.reconstruction().Image(photo);
    image.SetQvec({1, 0, 0, 0});
    image.SetTvec(-centers_[photo - 1]);
    return CompareWithNeighbours({}, map_, photo, map_.reconstruction().Camera(1),
                                 image.ProjectionMatrix());
  }

 private:
  void AddPhotos() {
    for (int i = 0; i < kNumFirst + kNumSecond; ++i) {
      const int along = i < kNumFirst ? i : i - kNumFirst;
      centers_.emplace_back(-1 + 0.3 * along, i < kNumFirst ? 0 : 0.1, -kDistance);
    }
    keypoint_.resize(centers_.size());
    photos_.resize(centers_.size());
  }

  void AddPoints(int count, double min_x, double max_x, double z, bool first, bool second) {
    std::uniform_real_distribution<double> x(min_x, max_x), y(-3.5, 3.5);
    for (int k = 0; k < count; ++k) {
      points_.emplace_back(x(random_), y(random_), z);
      for (size_t i = 0; i < centers_.size(); ++i) {
        const bool sees = i < kNumFirst ? first : second;
        keypoint_[i].push_back(sees ? AddKeypoint(i, points_.back()) : -1);
      }
    }
  }

  int AddKeypoint(size_t photo, const Eigen::Vector3d& xyz) {
    const Eigen::Vector3d in_camera = xyz - centers_[photo];
    const Eigen::Vector2d pixel = kFocalPx * in_camera.hnormalized() + Eigen::Vector2d(800, 600);
    if (pixel.minCoeff() < 0 || pixel.x() >= 1600 || pixel.y() >= 1200) return -1;
    photos_[photo].keypoints.push_back(
        {static_cast<float>(pixel.x()), static_cast<float>(pixel.y()), 1, 0, 0, 0, 0});
    return static_cast<int>(photos_[photo].keypoints.size()) - 1;
  }

  void Connect() {
    for (size_t i = 0; i < photos_.size(); ++i) {
      PhotoInput& photo = photos_[i];
      photo.image_id = static_cast<int64_t>(i) + 1;
      photo.camera_id = 1;
      photo.name = std::to_string(i);
      photo.width_px = 1600;
      photo.height_px = 1200;
      photo.focal_px = kFocalPx;
      ASSERT_TRUE(map_.AddPhoto(photo).ok());
      TwoViewPairs pairs;
      for (size_t j = 0; j < i; ++j) {
        pairs.emplace_back();
        pairs.back().other_id = static_cast<int64_t>(j) + 1;
        for (size_t p = 0; p < points_.size(); ++p) {
          if (keypoint_[i][p] < 0 || keypoint_[j][p] < 0) continue;
          pairs.back().inliers.emplace_back(keypoint_[i][p], keypoint_[j][p]);
        }
      }
      ASSERT_TRUE(map_.AddPairs(photo.image_id, pairs).ok());
    }
  }

  std::mt19937 random_;
  SceneMap map_;
  std::vector<Eigen::Vector3d> centers_, points_;
  std::vector<std::vector<int>> keypoint_;  // of a photo, of a point
  std::vector<PhotoInput> photos_;
};

TEST(LookAlike, OfTwoPlacesTheOneWithFewerPhotosIsFound) {
  Street street(kDistance);
  street.Register(kNumFirst + kNumSecond);
  EXPECT_EQ(FindLookAlikes({}, street.map(), 0), (std::vector<ImageId>{8, 9, 10, 11, 12, 13}));
}

TEST(LookAlike, ThePlaceThatTheMapBeganAtStays) {
  Street street(kDistance);
  street.Register(kNumFirst + kNumSecond);
  EXPECT_EQ(FindLookAlikes({}, street.map(), 9), (std::vector<ImageId>{1, 2, 3, 4, 5, 6, 7}));
}

TEST(LookAlike, OnePlaceIsLeftAlone) {
  Street street(kDistance, true);
  street.Register(kNumFirst + kNumSecond);
  EXPECT_TRUE(FindLookAlikes({}, street.map(), 0).empty());
}

TEST(LookAlike, WhatStandsBeforeThePlaceIsNoOtherPlace) {
  Street street(kDistance / 2);
  street.Register(kNumFirst + kNumSecond);
  EXPECT_TRUE(FindLookAlikes({}, street.map(), 0).empty());
}

TEST(LookAlike, SuspectsAreToldByWhatTheyMiss) {
  const Suspicion suspicion{{8, 9, 10, 11, 12, 13}, {}};
  Street street(kDistance / 2);
  street.Register(kNumFirst + kNumSecond);
  EXPECT_EQ(FindSuspectedLookAlikes({}, street.map(), 0, suspicion),
            (std::vector<ImageId>{8, 9, 10, 11, 12, 13}));
  Street one_place(kDistance, true);
  one_place.Register(kNumFirst + kNumSecond);
  EXPECT_TRUE(FindSuspectedLookAlikes({}, one_place.map(), 0, suspicion).empty());
}

TEST(LookAlike, APhotoOfAnotherPlaceMissesMuch) {
  Street street(kDistance);
  street.Register(kNumFirst);
  const CellVotes votes = street.CompareSecond(kNumFirst + 2);
  EXPECT_TRUE(MissesTooMuch({}, votes));
  EXPECT_EQ(votes.num_different, 0);
  EXPECT_GT(votes.num_seen, 60);
}

TEST(LookAlike, APhotoOfThePlaceMissesNothing) {
  Street street(kDistance, true);
  street.Register(kNumFirst);
  const CellVotes votes = street.CompareSecond(kNumFirst + 2);
  EXPECT_EQ(votes.num_missing, 0);
  EXPECT_GT(votes.num_seen, 150);
}

TEST(LookAlike, SidesOfAMergeAreCompared) {
  for (const bool same : {false, true}) {
    Street street(kDistance, same);
    street.Register(kNumFirst + kNumSecond);
    const CellVotes votes = CompareSides({}, street.map(), street.map().reconstruction(),
                                         {1, 2, 3, 4}, {9, 10, 11, 12});
    EXPECT_EQ(ShowsAnotherPlace({}, votes), !same);
  }
}

}  // namespace
}  // namespace skein
