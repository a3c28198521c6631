#include "core/attempt.h"

#include <gtest/gtest.h>

#include <memory>
#include <new>
#include <stdexcept>
#include <string>

namespace skein::attempt_test {

TEST(Attempt, GivesWhatTheWorkReturns) {
  EXPECT_EQ(*Attempt([] { return 7; }), 7);
  EXPECT_EQ(*Attempt([]() -> Result<std::string> { return std::string("done"); }), "done");
  EXPECT_EQ(Attempt([]() -> Result<int> { return NotFound("no blob"); }).code(),
            StatusCode::kNotFound);
  EXPECT_TRUE(Attempt([] {}).ok());
  EXPECT_EQ(Attempt([] { return DataLoss("cut short"); }).error(), "cut short");
  EXPECT_EQ(**Attempt([] { return std::make_unique<int>(3); }), 3);
}

TEST(Attempt, AnExceptionIsAFailureThatMayPass) {
  const Result<int> thrown = Attempt([]() -> int { throw std::runtime_error("no surface"); });
  EXPECT_EQ(thrown.code(), StatusCode::kUnavailable);
  EXPECT_EQ(thrown.error(), "no surface");
  EXPECT_EQ(Attempt([] { throw std::bad_alloc(); }).code, StatusCode::kUnavailable);
  EXPECT_EQ(Attempt([] { throw 7; }).error(), "unknown exception");
}

TEST(Attempt, BrokenStateGoesThrough) {
  const auto change = [] { ChangeWhole([] { throw std::bad_alloc(); }); };
  EXPECT_THROW(Attempt(change), BrokenState);
  int changed = 0;
  ChangeWhole([&] { ++changed; });
  EXPECT_EQ(changed, 1);
}

}  // namespace skein::attempt_test
