#include "event_loop/alive.h"

#include <gtest/gtest.h>

#include <functional>
#include <optional>

namespace skein::alive_test {

TEST(Alive, CallsAGuardedFunctionWithItsArguments) {
  const Alive alive;
  int sum = 0;
  const std::function<void(int, int)> add = alive.Guarded([&](int a, int b) { sum = a + b; });
  add(2, 3);
  EXPECT_EQ(sum, 5);
}

TEST(Alive, CallsNothingOnceTheObjectIsGone) {
  std::optional<Alive> alive(std::in_place);
  bool called = false;
  const std::function<void()> guarded = alive->Guarded([&] { called = true; });
  alive.reset();
  guarded();
  EXPECT_FALSE(called);
}

TEST(Alive, AFunctionMayEndItsOwnObject) {
  std::optional<Alive> alive(std::in_place);
  int num_calls = 0;
  const std::function<void()> guarded = alive->Guarded([&] {
    ++num_calls;
    alive.reset();
  });
  guarded();
  guarded();
  EXPECT_EQ(num_calls, 1);
}

}  // namespace skein::alive_test
