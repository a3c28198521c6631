#include "disambiguation/similar_structures.h"

#include <gtest/gtest.h>

#include <numeric>
#include <set>

#include "testing/synthetic_scene.h"
#include "testing/test_random.h"

namespace skein::similar_structures_test {

constexpr double kDistance = 8;  // of the cameras from the façade
constexpr int kNumFirst = 7, kNumSecond = 6;

// Photos along a façade at z = 0. Its left part is the same for all. On its right, the first photos
// see points that the second ones don't; these see others there.
class Street {
 public:
  // `right_distance`: of what the second photos see on the right. `unmatched`: photos whose right
  // side has no match with the others, as by another light. `num_in_burst`: the second photos are
  // so many, from one viewpoint.
  explicit Street(double right_distance, bool second_sees_the_same = false,
                  const std::set<ImageId>& unmatched = {}, int num_in_burst = 0)
      : random_(1) {
    const int divisor = num_in_burst > 0 ? 4 : 1;  // a burst sees this part of the façade
    AddPoints(300 / divisor, -3.0 / divisor, 0, 0, kBoth);
    AddPoints(500 / divisor, 0, 5.0 / divisor, 0, kFirst);
    if (!second_sees_the_same) {
      AddPoints(500 / divisor, 0, 5.0 / divisor, kDistance - right_distance, kSecond);
    }
    if (!unmatched.empty()) AddPoints(500, 0, 5, kDistance / 2, kThird);
    const int num_second = num_in_burst > 0 ? num_in_burst : kNumSecond;
    for (int i = 0; i < kNumFirst + num_second; ++i) {
      const bool is_first = i < kNumFirst;
      const double along = is_first ? i : num_in_burst > 0 ? 0.1 * i : i - kNumFirst;
      scene_.AddPose(Eigen::Matrix3d::Identity(),
                     {-1 + 0.3 * along, is_first ? 0 : 0.1, -kDistance});
      const Place place = i < kNumFirst || second_sees_the_same ? kFirst : kSecond;
      scene_.place_of_photo.push_back(unmatched.count(i + 1) > 0 ? kThird : place);
    }
    SyntheticOptions options;
    options.camera.width_px = 1600;
    options.camera.height_px = 1200;
    options.noise_px = 0;
    Photograph(options, &random_, &scene_);
    AddToMap(scene_, scene_.pairs, &map_);
  }

  SceneMap& map() { return map_; }

  void Register(int num_photos) {
    std::vector<ImageId> ids(num_photos);
    std::iota(ids.begin(), ids.end(), 1);
    RegisterAtTruth(scene_, ids, Eigen::Vector3d::Zero(), &map_);
  }

  CellVotes CompareSecond(int photo) {
    Image image = map_.reconstruction().Image(photo);
    image.SetQvec({1, 0, 0, 0});
    image.SetTvec(-scene_.Center(photo - 1));
    return CompareWithNeighbours(map_, photo, map_.reconstruction().Camera(1),
                                 image.ProjectionMatrix());
  }

 private:
  enum Place { kBoth, kFirst, kSecond, kThird };

  void AddPoints(int count, double min_x, double max_x, double z, Place place) {
    for (int k = 0; k < count; ++k) {
      const double height = Uniform(-3.5, 3.5, &random_);
      scene_.points.emplace_back(Uniform(min_x, max_x, &random_), height, z);
      scene_.place_of_point.push_back(place);
    }
  }

  std::mt19937 random_;
  SyntheticScene scene_;
  SceneMap map_;
};

TEST(SimilarStructures, OfTwoPlacesTheOneWithFewerPhotosIsFound) {
  Street street(kDistance);
  street.Register(kNumFirst + kNumSecond);
  for (const int num_threads : {1, 3}) {
    EXPECT_EQ(FindPhotosOfAnotherPlace(street.map(), 0, num_threads),
              (std::vector<ImageId>{8, 9, 10, 11, 12, 13}));
  }
}

// oppaiyama with bursts. A photo of the burst has 42 to 53 different cells: too few to be of
// another place.
TEST(SimilarStructures, ABurstIsOneWitness) {
  for (const int num_photos : {2, 8}) {
    Street street(kDistance, false, {}, num_photos);
    street.Register(kNumFirst + num_photos);
    EXPECT_TRUE(FindPhotosOfAnotherPlace(street.map(), 0).empty()) << num_photos;
  }
}

TEST(SimilarStructures, ThePlaceThatTheMapBeganAtStays) {
  Street street(kDistance);
  street.Register(kNumFirst + kNumSecond);
  EXPECT_EQ(FindPhotosOfAnotherPlace(street.map(), 9), (std::vector<ImageId>{1, 2, 3, 4, 5, 6, 7}));
}

TEST(SimilarStructures, OnePlaceIsLeftAlone) {
  Street street(kDistance, true);
  street.Register(kNumFirst + kNumSecond);
  EXPECT_TRUE(FindPhotosOfAnotherPlace(street.map(), 0).empty());
}

TEST(SimilarStructures, WhatStandsBeforeThePlaceIsNoOtherPlace) {
  Street street(kDistance / 2);
  street.Register(kNumFirst + kNumSecond);
  EXPECT_TRUE(FindPhotosOfAnotherPlace(street.map(), 0).empty());
}

TEST(SimilarStructures, CandidatesAreJudgedByMissingCells) {
  const SimilarPlaceCandidates candidates{{8, 9, 10, 11, 12, 13}, {}};
  Street street(kDistance / 2);
  street.Register(kNumFirst + kNumSecond);
  EXPECT_EQ(FindPhotosOfAnotherPlaceByMissingCells(street.map(), 0, candidates),
            (std::vector<ImageId>{8, 9, 10, 11, 12, 13}));
  Street one_place(kDistance, true);
  one_place.Register(kNumFirst + kNumSecond);
  EXPECT_TRUE(FindPhotosOfAnotherPlaceByMissingCells(one_place.map(), 0, candidates).empty());
}

TEST(SimilarStructures, APhotoOfAnotherPlaceMissesMuch) {
  Street street(kDistance);
  street.Register(kNumFirst);
  const CellVotes votes = street.CompareSecond(kNumFirst + 2);
  EXPECT_TRUE(HasTooManyMissingCells(votes, kMinCells));
  EXPECT_EQ(votes.num_different, 0);
  EXPECT_GT(votes.num_seen, 60);
}

TEST(SimilarStructures, APhotoOfThePlaceMissesNothing) {
  Street street(kDistance, true);
  street.Register(kNumFirst);
  const CellVotes votes = street.CompareSecond(kNumFirst + 2);
  EXPECT_EQ(votes.num_missing, 0);
  EXPECT_GT(votes.num_seen, 150);
}

PlacesOfTwoSets PlacesOf(Street* street) {
  street->Register(kNumFirst + kNumSecond);
  return ComparePlaces(street->map(), street->map().reconstruction(), {1, 2, 3, 4},
                       {9, 10, 11, 12});
}

// `skein sim --scenario shared-object`: what stands around the object has another depth in each of
// its two rooms, so no cell is different.
TEST(SimilarStructures, PhotosOfOneObjectInTwoPlacesAreToldByWhatTheyMiss) {
  Street two(kDistance / 2);
  const PlacesOfTwoSets places = PlacesOf(&two);
  EXPECT_TRUE(places.differ);
  EXPECT_NE(places.reason.find("are missing"), std::string::npos) << places.reason;
  Street alike(kDistance);
  EXPECT_NE(PlacesOf(&alike).reason.find("are different"), std::string::npos);
  Street one(kDistance, true);
  EXPECT_FALSE(PlacesOf(&one).differ);
}

// A crowd's photos of one place (statue-of-liberty), some by another light: half of the pairs
// across miss 0.4 of their cells.
TEST(SimilarStructures, PhotosThatMatchLittleMakeNoOtherPlace) {
  Street some(kDistance, true, {3, 4});
  EXPECT_FALSE(PlacesOf(&some).differ);
  Street most(kDistance, true, {2, 3, 4});
  EXPECT_TRUE(PlacesOf(&most).differ);
}

}  // namespace skein::similar_structures_test
