#include "web/thumbnails.h"

#include <gtest/gtest.h>

namespace skein::thumbnails_test {

std::shared_ptr<const Bytes> SomeBytes(size_t size) { return std::make_shared<const Bytes>(size); }

TEST(Thumbnails, ThoseThatWereNotAskedForLongestGo) {
  ThumbnailCache cache(100);
  cache.Add(1, SomeBytes(40));
  cache.Add(2, SomeBytes(40));
  EXPECT_NE(cache.Find(1), nullptr);
  cache.Add(3, SomeBytes(40));
  EXPECT_EQ(cache.Find(2), nullptr);
  EXPECT_NE(cache.Find(1), nullptr);
  EXPECT_EQ(cache.size_bytes(), 80u);
  cache.Add(4, SomeBytes(101));
  EXPECT_EQ(cache.Find(4), nullptr) << "larger than the cache";
  cache.Add(3, SomeBytes(40));
  EXPECT_EQ(cache.size_bytes(), 80u) << "once";
}

}  // namespace skein::thumbnails_test
