#include "matching/coarse_search.h"

#include <gtest/gtest.h>

#include <vector>

namespace skein::coarse_search_test {

using Ids = std::vector<int64_t>;

TEST(CoarseSearch, GivesEachPhotoOnce) {
  CoarseSearch search({5, 3, 8});
  EXPECT_EQ(search.Take(2), (Ids{5, 3}));
  EXPECT_EQ(search.Take(2), (Ids{8}));
  EXPECT_TRUE(search.Take(2).empty());
}

TEST(CoarseSearch, TheBestHaveMostMatches) {
  CoarseSearch search({});
  search.Tell(1, 20);
  search.Tell(2, 90);
  search.Tell(4, 40);
  search.Tell(3, 40);
  EXPECT_EQ(search.Best(), (Ids{2, 3, 4, 1}));
}

TEST(CoarseSearch, TooFewMatchesMakeNoPair) {
  CoarseSearch search({});
  search.Tell(1, 14);
  EXPECT_TRUE(search.Best().empty());
}

TEST(CoarseSearch, TenAreEnough) {
  CoarseSearch search({});
  for (int i = 0; i < 30; ++i) search.Tell(i, 100 + i);
  const Ids best = search.Best();
  EXPECT_EQ(best.size(), 10u);
  EXPECT_EQ(best.front(), 29);
}

}  // namespace skein::coarse_search_test
