#include "export/las.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <map>
#include <string>

#include "core/file.h"
#include "testing/test_folder.h"

namespace skein::las_test {

template <typename T>
T ReadAt(const Bytes& bytes, size_t at) {
  T value{};
  if (at + sizeof(T) <= bytes.size()) std::memcpy(&value, bytes.data() + at, sizeof(T));
  return value;
}

// The records that the header names, by their ids (LAS 1.2, section "Variable Length Records").
std::map<int, size_t> RecordsOf(const Bytes& las) {
  std::map<int, size_t> records;
  size_t at = ReadAt<uint16_t>(las, 94);
  for (uint32_t i = 0; i < ReadAt<uint32_t>(las, 100); ++i) {
    records[ReadAt<uint16_t>(las, at + 18)] = at + 54;
    at += 54 + ReadAt<uint16_t>(las, at + 20);
  }
  return records;
}

// Value of a GeoKey: itself, or of the doubles.
double GeoKey(const Bytes& las, int key) {
  const std::map<int, size_t> records = RecordsOf(las);
  const size_t directory = records.at(34735);
  for (int i = 1; i <= ReadAt<uint16_t>(las, directory + 6); ++i) {
    const size_t at = directory + 8 * static_cast<size_t>(i);
    if (ReadAt<uint16_t>(las, at) != key) continue;
    const uint16_t value = ReadAt<uint16_t>(las, at + 6);
    if (ReadAt<uint16_t>(las, at + 2) == 0) return value;
    return ReadAt<double>(las, records.at(34736) + sizeof(double) * value);
  }
  return std::nan("");
}

struct ReadPoint {
  Eigen::Vector3d position;
  int red, green, blue;
};

std::vector<ReadPoint> ReadPoints(const Bytes& las) {
  std::vector<ReadPoint> points;
  const uint32_t begin = ReadAt<uint32_t>(las, 96), count = ReadAt<uint32_t>(las, 107);
  const uint16_t size = ReadAt<uint16_t>(las, 105);
  EXPECT_EQ(las.size(), begin + size_t{size} * count);
  for (uint32_t i = 0; i < count; ++i) {
    const size_t at = begin + size_t{size} * i;
    ReadPoint read{};
    for (int axis = 0; axis < 3; ++axis) {
      read.position[axis] =
          ReadAt<int32_t>(las, at + 4 * axis) * ReadAt<double>(las, 131 + 8 * axis) +
          ReadAt<double>(las, 155 + 8 * axis);
    }
    read.red = ReadAt<uint16_t>(las, at + 20);
    read.green = ReadAt<uint16_t>(las, at + 22);
    read.blue = ReadAt<uint16_t>(las, at + 24);
    points.push_back(read);
  }
  return points;
}

class LasTest : public testing::Test {
 protected:
  std::string File() const { return (folder_.path() / "points.las").string(); }

  std::vector<LasPoint> points_ = {{{-12.5f, 30.25f, 2}, {10, 20, 255}},
                                   {{40.125f, -7, 3.5f}, {0, 128, 1}},
                                   {{0, 0, -1}, {7, 8, 9}}};
  TestFolder folder_;
};

TEST_F(LasTest, PointsOnTheEarthComeBackWithTheirProjection) {
  ASSERT_TRUE(WriteLas(points_, GeodeticPosition{47.5, 8.25, 400.0}, File()).ok());
  const Bytes las = *ReadFile(File());
  EXPECT_EQ(std::memcmp(las.data(), "LASF", 4), 0);
  EXPECT_EQ(ReadAt<double>(las, 131), 0.001);
  EXPECT_NEAR(ReadAt<double>(las, 179), 40.125, 1e-3) << "largest x";
  EXPECT_NEAR(ReadAt<double>(las, 219), 399, 1e-3) << "least z";
  EXPECT_EQ(GeoKey(las, 1024), 1) << "projected";
  EXPECT_EQ(GeoKey(las, 3075), 1) << "transverse Mercator";
  EXPECT_EQ(GeoKey(las, 3081), 47.5) << "latitude of the origin";
  EXPECT_EQ(GeoKey(las, 3080), 8.25) << "longitude of the origin";
  const std::vector<ReadPoint> read = ReadPoints(*ReadFile(File()));
  ASSERT_EQ(read.size(), points_.size());
  EXPECT_LT((read[1].position - Eigen::Vector3d(40.125, -7, 403.5)).norm(), 1e-3);
  EXPECT_EQ(read[0].red, 65535);
  EXPECT_EQ(read[1].green, 128 * 257);
  EXPECT_EQ(read[2].blue, 7 * 257);
}

TEST_F(LasTest, PointsOfAMapHaveNoProjection) {
  for (LasPoint& point : points_) point.position /= 1000;
  ASSERT_TRUE(WriteLas(points_, std::nullopt, File()).ok());
  EXPECT_EQ(RecordsOf(*ReadFile(File())).count(34735), 0U);
  const std::vector<ReadPoint> read = ReadPoints(*ReadFile(File()));
  ASSERT_EQ(read.size(), points_.size());
  for (size_t i = 0; i < read.size(); ++i) {
    EXPECT_LT((read[i].position - points_[i].position).norm(), 1e-7);
  }
}

TEST_F(LasTest, PointsInANationalGridKeepTheirMillimetres) {
  for (LasPoint& point : points_) point.position += Eigen::Vector3d(2'600'000.001, 1'200'000, 400);
  ASSERT_TRUE(WriteLas(points_, std::nullopt, File()).ok());
  const std::vector<ReadPoint> read = ReadPoints(*ReadFile(File()));
  ASSERT_EQ(read.size(), points_.size());
  for (size_t i = 0; i < read.size(); ++i) {
    EXPECT_LT((read[i].position - points_[i].position).norm(), 1e-4);
  }
}

TEST_F(LasTest, TellsWhatCannotBeWritten) {
  EXPECT_EQ(WriteLas({}, std::nullopt, File()).code, StatusCode::kFailedPrecondition);
  EXPECT_FALSE(WriteLas(points_, std::nullopt, folder_.path() / "none" / "points.las").ok());
  points_[0].position.x() = 1e8f;
  EXPECT_EQ(WriteLas(points_, GeodeticPosition{}, File()).code, StatusCode::kInvalidArgument);
}

}  // namespace skein::las_test
