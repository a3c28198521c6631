#include "matching/descriptor_cells.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

namespace skein::descriptor_cells_test {

constexpr int kNumCells = 20;

std::vector<uint8_t> RandomDescriptors(int count, std::mt19937* random) {
  std::vector<uint8_t> descriptors;
  for (int i = 0; i < count * kDescriptorDim; ++i) descriptors.push_back((*random)() % 64);
  return descriptors;
}

// Of kNumCells cells around random descriptors, with principal axes that are no unit vectors.
Codebook RandomCodebook() {
  std::mt19937 random(3);
  const std::vector<uint8_t> descriptors = RandomDescriptors(kNumCells, &random);
  Codebook codebook;
  Codebook::Matrix centres(kNumCells, kDescriptorDim);
  std::copy(descriptors.begin(), descriptors.end(), centres.data());
  centres.rowwise().normalize();
  codebook.mean = centres.colwise().mean();
  codebook.projection = Codebook::Matrix::Identity(kDescriptorDim, kDescriptorDim);
  codebook.projection.row(0).swap(codebook.projection.row(7));
  codebook.centres =
      (centres.rowwise() - codebook.mean.transpose()) * codebook.projection.transpose();
  return codebook;
}

std::vector<std::set<uint32_t>> CellsByFeature(const CellLists& lists, size_t num_features) {
  std::vector<std::set<uint32_t>> cells(num_features);
  for (uint32_t k = 0; k + 1 < lists.begin.size(); ++k) {
    const IndexSpan span = lists[k];
    EXPECT_TRUE(std::is_sorted(span.data, span.data + span.count));
    for (int i = 0; i < span.count; ++i) cells[span.data[i]].insert(k);
  }
  return cells;
}

TEST(DescriptorCells, HomeIsTheCellThatTheCodebookNames) {
  std::mt19937 random(5);
  const Codebook codebook = RandomCodebook();
  const std::vector<uint8_t> descriptors = RandomDescriptors(300, &random);
  const FeatureCells cells = DescriptorCells(codebook).Assign(CompactDescriptors(descriptors));
  const Codebook::Matrix points = ProjectDescriptors(codebook, descriptors.data(), 300);
  const std::vector<int> expected = NearestCentres(points, codebook.centres);
  const auto home = CellsByFeature(cells.home, 300), near = CellsByFeature(cells.near, 300);
  const auto close = CellsByFeature(cells.close, 300);
  for (size_t i = 0; i < 300; ++i) {
    ASSERT_EQ(home[i].size(), 1u);
    EXPECT_EQ(near[i].size(), 8u);
    EXPECT_EQ(close[i].size(), 4u);
    EXPECT_EQ(close[i].count(*home[i].begin()), 1u);
    EXPECT_TRUE(std::includes(near[i].begin(), near[i].end(), close[i].begin(), close[i].end()));
    const auto distance = [&](size_t k) {
      return (points.row(i) - codebook.centres.row(k)).norm();
    };
    // Rounding decides where two are equally near.
    EXPECT_LT(distance(*home[i].begin()), 1.01f * distance(expected[i]));
  }
}

TEST(DescriptorCells, WithFewCellsAllAreNear) {
  std::mt19937 random(5);
  Codebook codebook = RandomCodebook();
  codebook.centres.conservativeResize(3, Eigen::NoChange);
  const FeatureCells cells = DescriptorCells(codebook).Assign(RandomDescriptors(10, &random));
  for (const auto& near : CellsByFeature(cells.near, 10)) EXPECT_EQ(near.size(), 3u);
}

TEST(DescriptorCells, EachFeatureMeetsThoseThatHaveItsCellNearOnce) {
  std::mt19937 random(5);
  const DescriptorCells cells(RandomCodebook());
  const FeatureCells first = cells.Assign(RandomDescriptors(60, &random));
  const FeatureCells second = cells.Assign(RandomDescriptors(50, &random));
  std::set<std::pair<uint32_t, uint32_t>> met;
  size_t num_compared = 0;
  for (const ProductPart& part : PartsOf(first.home, second.near)) {
    for (int i = 0; i < part.rows.count; ++i) {
      for (int j = 0; j < part.columns.count; ++j) {
        met.emplace(part.rows.data[i], part.columns.data[j]);
        ++num_compared;
      }
    }
  }
  EXPECT_EQ(met.size(), num_compared);
  const auto home = CellsByFeature(first.home, 60), near = CellsByFeature(second.near, 50);
  for (uint32_t i = 0; i < 60; ++i) {
    for (uint32_t j = 0; j < 50; ++j) {
      EXPECT_EQ(met.count({i, j}), near[j].count(*home[i].begin())) << i << " " << j;
    }
  }
}

TEST(DescriptorCells, WithoutFeaturesAreEmpty) {
  const FeatureCells cells = DescriptorCells(RandomCodebook()).Assign({});
  EXPECT_FALSE(cells.empty());
  for (const ProductPart& part : PartsOf(cells.home, cells.near)) EXPECT_EQ(part.rows.count, 0);
  EXPECT_TRUE(FeatureCells().empty());
}

}  // namespace skein::descriptor_cells_test
