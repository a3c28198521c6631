#include "depth/sweep_kernels.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <random>
#include <vector>

namespace skein::sweep_kernels_test {

using Row = std::vector<uint8_t>;

constexpr int kWidth = 176;  // a multiple of 16, but of neither 32 nor 64
constexpr int kSteps = 96;
constexpr int kColumn = kSteps + 2 * kSweepLanes;

class SweepKernelsOfVersion : public testing::TestWithParam<InstructionSet> {
 protected:
  void SetUp() override {
    if (!IsInstructionSetSupported(GetParam())) GTEST_SKIP() << "not supported by this processor";
  }

  const SweepKernels& Kernels() const { return SweepKernelsOf(GetParam()); }

  int Random(int least, int most) { return std::uniform_int_distribution<int>(least, most)(rng_); }

  Row RandomRow(size_t size, int most) {
    Row row(size);
    for (uint8_t& value : row) value = static_cast<uint8_t>(Random(0, most));
    return row;
  }

  std::mt19937 rng_{12345};
};

TEST_P(SweepKernelsOfVersion, WarpsByLinearInterpolation) {
  const Row above = RandomRow(kWidth + 2 * kSweepMargin, 255);
  const Row below = RandomRow(kWidth + 2 * kSweepMargin, 255);
  std::vector<int32_t> window(kWidth / kSweepBlock);
  for (int32_t& first : window) first = Random(0, kWidth - kSweepWindow);
  std::sort(window.begin(), window.end());
  const Row pairs = RandomRow(2 * kWidth, kSweepWindow - 1);
  std::vector<int8_t> weights;
  for (int x = 0; x < kWidth; ++x) {
    weights.push_back(static_cast<int8_t>(Random(0, kWeightUnit)));
    weights.push_back(static_cast<int8_t>(kWeightUnit - weights.back()));
  }
  Row scratch(kWidth + 2 * kSweepMargin + kSweepLanes), out(kWidth);
  const WarpTask task{
      &above[kSweepMargin], &below[kSweepMargin], 23,     kWidth,         window.data(),
      pairs.data(),         weights.data(),       kWidth, scratch.data(), out.data()};
  Kernels().warp(&task, 1);
  const auto between = [](int a, int b, int weight) {
    return (a * (kWeightUnit - weight) + b * weight + kWeightUnit / 2) / kWeightUnit;
  };
  for (int x = 0; x < kWidth; ++x) {
    int value[2];
    for (int i = 0; i < 2; ++i) {
      const int at = window[x / kSweepBlock] + pairs[2 * x + i];
      value[i] = between(task.above[at], task.below[at], task.below_weight);
    }
    ASSERT_EQ(out[x], between(value[0], value[1], weights[2 * x + 1])) << x;
  }
}

// The bits in which the windows around column x differ, in one row and view.
int HammingDistance(const CensusTask& task, int view, int x) {
  const auto bit = [&](const uint8_t* const* rows, int y, int dx) {
    return rows[y][x + dx] >= std::min(255, rows[kCensusRadius][x] + task.threshold);
  };
  int count = 0;
  for (int y = 0; y < kCensusRows; ++y) {
    for (int dx = -kCensusRadius; dx <= kCensusRadius; ++dx) {
      const int dy = y - kCensusRadius;
      if ((dx + dy) % 2 != 0 || (dx == 0 && dy == 0)) continue;
      count += bit(task.reference, y, dx) != bit(task.views[view], y, dx);
    }
  }
  return count;
}

TEST_P(SweepKernelsOfVersion, CensusCountsTheBitsThatDiffer) {
  for (int views = 1; views <= kMaxSweepViews; ++views) {
    CensusTask task{};
    std::vector<Row> rows;
    for (int i = 0; i < (views + 1) * kCensusRows; ++i) {
      rows.push_back(RandomRow(kWidth + 2 * kSweepMargin, i % 2 == 0 ? 255 : 9));
    }
    for (int y = 0; y < kCensusRows; ++y) {
      task.reference[y] = &rows[y][kSweepMargin];
      for (int i = 0; i < views; ++i) {
        task.views[i][y] = &rows[(i + 1) * kCensusRows + y][kSweepMargin];
      }
    }
    for (int i = 0; i < views; ++i) {
      task.first[i] = 20 * i;
      task.last[i] = kWidth - 70 * i;  // some vectors are seen by fewer views
    }
    Row scratch(views * (kWidth + kSweepMargin)), out(kWidth + kSweepMargin);
    task.num_views = views;
    task.threshold = 3;
    task.truncation = 6;
    task.width = kWidth;
    task.scratch = scratch.data();
    task.out = out.data();
    Kernels().census(task);
    for (int x = 0; x < kWidth; ++x) {
      int costs[kMaxSweepViews], least = kCensusBits, sum = 0;
      for (int i = 0; i < views; ++i) {
        const bool is_seen = x >= task.first[i] && x < task.last[i];
        costs[i] = is_seen ? HammingDistance(task, i, x) : 255;
        least = std::min(least, costs[i]);
      }
      for (int i = 0; i < views; ++i) sum += std::min(costs[i], least + task.truncation);
      ASSERT_EQ(out[x], sum) << views << " views, column " << x;
    }
  }
}

// Costs of paths: columns -1 to kWidth, each with room around its steps.
struct PathCosts {
  Row costs = Row((kWidth + 2) * kColumn), minima = Row(kWidth + 2);

  uint8_t* Steps(int column) { return &costs[(column + 1) * kColumn + kSweepLanes]; }
  uint8_t& Min(int column) { return minima[column + 1]; }
};

constexpr uint8_t kSmall = 10;

// Hirschmueller 2008, equation 13.
void Extend(const uint8_t* before, int before_min, const uint8_t* cost, int large, uint8_t* now) {
  for (int s = 0; s < kSteps; ++s) {
    int best = std::min<int>(before[s], before_min + large);
    if (s > 0) best = std::min(best, before[s - 1] + kSmall);
    if (s + 1 < kSteps) best = std::min(best, before[s + 1] + kSmall);
    now[s] = static_cast<uint8_t>(cost[s] + best - before_min);
  }
}

TEST_P(SweepKernelsOfVersion, PathsFollowSemiGlobalMatching) {
  const Row cost = RandomRow(kWidth * kSteps, 90), grey = RandomRow(kWidth, 255);
  const Row grey_before = RandomRow(kWidth + 2, 255);
  Row large(256), scratch(2 * kColumn);
  for (int i = 0; i < 256; ++i) large[i] = static_cast<uint8_t>(80 - i / 4);
  PathCosts before[3], now[3];
  PathTask task{};
  for (int k = 0; k < 3; ++k) {
    for (int x = -1; x <= kWidth; ++x) {
      uint8_t* steps = before[k].Steps(x);
      std::memset(steps - kSweepLanes, 255 - kSmall, kColumn);
      for (int s = 0; s < kSteps; ++s) steps[s] = static_cast<uint8_t>(Random(5, 120));
      before[k].Min(x) = *std::min_element(steps, steps + kSteps);
    }
    task.before[k] = before[k].costs.data();
    task.before_min[k] = before[k].minima.data();
    task.now[k] = now[k].costs.data();
    task.now_min[k] = now[k].minima.data();
  }
  const std::vector<uint16_t> before_sum(kWidth * kSteps, 7);
  std::vector<uint16_t> sum(kWidth * kSteps);
  task.cost = cost.data();
  task.grey = grey.data();
  task.grey_before = &grey_before[1];
  task.width = kWidth;
  task.steps = kSteps;
  task.direction = -1;
  task.small_penalty = kSmall;
  task.large_penalty = large.data();
  task.scratch = scratch.data();
  task.sum_before = before_sum.data();
  task.sum = sum.data();
  Kernels().paths(task);
  Row along(kSteps, 0);
  int along_min = 0, grey_along = grey[kWidth - 1];
  for (int x = kWidth - 1; x >= 0; --x) {
    Row path(kSteps);
    Extend(along.data(), along_min, &cost[x * kSteps], large[std::abs(grey[x] - grey_along)],
           path.data());
    along = path;
    along_min = *std::min_element(along.begin(), along.end());
    grey_along = grey[x];
    std::vector<int> expected(along.begin(), along.end());
    for (int k = 0; k < 3; ++k) {
      const int from = x + k - 1;
      Extend(before[k].Steps(from), before[k].Min(from), &cost[x * kSteps],
             large[std::abs(grey[x] - task.grey_before[from])], path.data());
      ASSERT_TRUE(std::equal(path.begin(), path.end(), now[k].Steps(x))) << x;
      ASSERT_EQ(now[k].Min(x), *std::min_element(path.begin(), path.end())) << x;
      for (int s = 0; s < kSteps; ++s) expected[s] += path[s];
    }
    for (int s = 0; s < kSteps; ++s) ASSERT_EQ(sum[x * kSteps + s], expected[s] + 7) << x;
  }
}

// A choice among some of a column's steps.
TEST_P(SweepKernelsOfVersion, ChoosesTheFirstStepOfLeastCost) {
  constexpr int kStride = kSteps + 2 * kSweepLanes, kFirst = kSweepLanes;
  std::vector<uint16_t> sums(kWidth * kStride);
  for (uint16_t& sum : sums) sum = static_cast<uint16_t>(Random(600, 700));
  const Row cost = RandomRow(kWidth * kStride, 96);
  std::vector<StepChoice> out(kWidth);
  Kernels().choose({&sums[kFirst], &cost[kFirst], kWidth, kSteps, kStride, out.data()});
  for (int x = 0; x < kWidth; ++x) {
    const uint16_t* of = &sums[x * kStride + kFirst];
    const uint8_t* costs = &cost[x * kStride + kFirst];
    const int step = static_cast<int>(std::min_element(of, of + kSteps) - of);
    int second = 0xffff, mean = 0;
    for (int s = 0; s < kSteps; ++s) {
      if (std::abs(s - step) > 2) second = std::min<int>(second, of[s]);
      mean += costs[s];
    }
    ASSERT_EQ(out[x].step, step);
    ASSERT_EQ(out[x].least, of[step]);
    ASSERT_EQ(out[x].before, step > 0 ? of[step - 1] : 0xffff);
    ASSERT_EQ(out[x].after, step + 1 < kSteps ? of[step + 1] : 0xffff);
    ASSERT_EQ(out[x].second, second);
    ASSERT_EQ(out[x].mean, 16 * mean / kSteps);
    ASSERT_EQ(out[x].cost, costs[step]);
  }
}

TEST_P(SweepKernelsOfVersion, TransposesRowsOfSteps) {
  std::vector<Row> rows;
  std::vector<const uint8_t*> pointers;
  for (int s = 0; s < kSteps; ++s) rows.push_back(RandomRow(kWidth, 255));
  for (const Row& row : rows) pointers.push_back(row.data());
  Row out(kWidth * kSteps);
  Kernels().transpose({pointers.data(), kWidth, kSteps, out.data()});
  for (int x = 0; x < kWidth; ++x) {
    for (int s = 0; s < kSteps; ++s) ASSERT_EQ(out[x * kSteps + s], rows[s][x]);
  }
}

INSTANTIATE_TEST_SUITE_P(Versions, SweepKernelsOfVersion, testing::ValuesIn(kInstructionSets),
                         [](const auto& info) { return InstructionSetName(info.param); });

}  // namespace skein::sweep_kernels_test
