#include "guidance/free_space.h"

#include <gtest/gtest.h>

namespace skein::free_space_test {

// A photo at the origin observes points on a wall, 10 units ahead and 2 to each side.
GuidedMap OnePhotoOfAWall() {
  GuidedMap map;
  map.photos.push_back({});
  for (double x = -2; x <= 2; x += 0.05) map.points.push_back({{x, 0, 10}, {0}});
  return map;
}

TEST(FreeSpace, IsClearWhereAPhotoHasLookedThrough) {
  const FreeSpace space(OnePhotoOfAWall(), 0.5, 30);
  EXPECT_TRUE(space.IsClear({0, 0, 0}, {0, 0, 10}));
  EXPECT_TRUE(space.IsClear({0, 0, 4}, {1, 0, 10}));
}

TEST(FreeSpace, IsNotClearBesideOrBehindWhatPhotosSaw) {
  const FreeSpace space(OnePhotoOfAWall(), 0.5, 30);
  EXPECT_FALSE(space.IsClear({4, 0, 4}, {1, 0, 10}));
  EXPECT_FALSE(space.IsClear({0, 0, 16}, {0, 0, 10}));
  EXPECT_FALSE(space.IsClear({0, 3, 4}, {0, 0, 10}));
}

TEST(FreeSpace, KnowsNothingBeyondItsReach) {
  const FreeSpace space(OnePhotoOfAWall(), 0.5, 4);
  EXPECT_TRUE(space.IsClear({0, 0, 0}, {0, 0, 10}));  // as far as its reach
  EXPECT_FALSE(space.IsClear({0, 0, 5}, {0, 0, 10}));
}

TEST(FreeSpace, WhatIsFarOutsideOfAllCellsIsNoFault) {
  GuidedMap map = OnePhotoOfAWall();
  map.points.push_back({{1e12, 0, 1e12}, {0}});
  const FreeSpace space(map, 1e-6, 3e-6);
  EXPECT_FALSE(space.IsClear({1e12, 0, 0}, {0, 0, 1e12}) && space.IsClear({1, 0, 0}, {1, 0, 10}));
}

}  // namespace skein::free_space_test
