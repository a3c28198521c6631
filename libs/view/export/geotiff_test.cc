#include "export/geotiff.h"

#include <geotiff/geotiffio.h>
#include <geotiff/xtiffio.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <opencv2/imgcodecs.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/file.h"
#include "testing/test_folder.h"
#include "testing/test_tiff.h"

namespace skein::geotiff_test {

const GridPlace kPlace{GeodeticPosition{47.5, 8.25, 400.0}, -12.5, 30, 0.25};

class GeoTiffTest : public testing::Test {
 protected:
  std::string File() const { return (folder_.path() / "grid.tif").string(); }
  TestFolder folder_;
};

TEST_F(GeoTiffTest, HeightsComeBackWithTheirHoles) {
  cv::Mat1f heights(300, 520);  // not a multiple of a tile
  for (int y = 0; y < heights.rows; ++y) {
    for (int x = 0; x < heights.cols; ++x) heights(y, x) = 400 + 0.125f * y - 0.5f * x;
  }
  heights(7, 300) = std::numeric_limits<float>::quiet_NaN();
  ASSERT_TRUE(WriteGeoTiff(heights, kPlace, {}, File()).ok());
  const cv::Mat1f read = cv::imread(File(), cv::IMREAD_UNCHANGED);
  ASSERT_EQ(read.size(), heights.size());
  EXPECT_TRUE(std::isnan(read(7, 300)));
  EXPECT_EQ(read(299, 519), heights(299, 519));
  EXPECT_EQ(read(12, 255), heights(12, 255));
}

TEST_F(GeoTiffTest, ColoursComeBackWithTheirAlpha) {
  cv::Mat4b colours(40, 30, cv::Vec4b(10, 20, 30, 255));
  colours(3, 4) = cv::Vec4b(0, 0, 0, 0);
  ASSERT_TRUE(WriteGeoTiff(colours, kPlace, {}, File()).ok());
  const cv::Mat4b read = cv::imread(File(), cv::IMREAD_UNCHANGED);
  ASSERT_EQ(read.size(), colours.size());
  EXPECT_EQ(read(0, 0), cv::Vec4b(10, 20, 30, 255));
  EXPECT_EQ(read(3, 4)[3], 0);
}

TEST_F(GeoTiffTest, ThePlaceIsInItsKeys) {
  ASSERT_TRUE(WriteGeoTiff(cv::Mat1f(10, 10, 0.0f), kPlace, {}, File()).ok());
  const std::unique_ptr<TIFF, void (*)(TIFF*)> tiff(XTIFFOpen(File().c_str(), "r"), XTIFFClose);
  ASSERT_NE(tiff, nullptr);
  uint16_t count = 0;
  double* values = nullptr;
  ASSERT_EQ(TIFFGetField(tiff.get(), TIFFTAG_GEOTIEPOINTS, &count, &values), 1);
  ASSERT_EQ(count, 6);
  EXPECT_EQ(values[3], -12.5);
  EXPECT_EQ(values[4], 30);
  const std::unique_ptr<GTIF, void (*)(GTIF*)> keys(GTIFNew(tiff.get()), GTIFFree);
  double latitude = 0;
  ASSERT_EQ(GTIFKeyGet(keys.get(), ProjNatOriginLatGeoKey, &latitude, 0, 1), 1);
  EXPECT_EQ(latitude, 47.5);
}

TEST_F(GeoTiffTest, MetadataIsInGdalsTag) {
  constexpr uint16_t kTag = 42112;
  const cv::Mat1f heights(10, 10, 0.0f);
  ASSERT_TRUE(WriteGeoTiff(heights, kPlace, {{"alone", "0.5"}, {"a<b", "\"c\" & d"}}, File()).ok());
  EXPECT_EQ(TiffText(File(), kTag),
            "<GDALMetadata>\n"
            "  <Item name=\"a&lt;b\">&quot;c&quot; &amp; d</Item>\n"
            "  <Item name=\"alone\">0.5</Item>\n"
            "</GDALMetadata>\n");
  EXPECT_EQ(TiffText(File(), 42113), "nan");
  ASSERT_TRUE(WriteGeoTiff(cv::Mat4b(4, 4, cv::Vec4b()), kPlace, {}, File()).ok());
  EXPECT_EQ(TiffText(File(), kTag), "") << "no metadata, no tag";
}

struct Level {
  bool is_reduced;
  uint32_t width, height;
  uint64_t directory, first_tile;  // offsets in the file
};

std::vector<Level> LevelsOf(const std::string& file) {
  const std::unique_ptr<TIFF, void (*)(TIFF*)> tiff(XTIFFOpen(file.c_str(), "r"), XTIFFClose);
  std::vector<Level> levels;
  do {
    Level level{};
    uint32_t type = 0;
    TIFFGetField(tiff.get(), TIFFTAG_SUBFILETYPE, &type);
    level.is_reduced = type == FILETYPE_REDUCEDIMAGE;
    TIFFGetField(tiff.get(), TIFFTAG_IMAGEWIDTH, &level.width);
    TIFFGetField(tiff.get(), TIFFTAG_IMAGELENGTH, &level.height);
    level.directory = TIFFCurrentDirOffset(tiff.get());
    level.first_tile = TIFFGetStrileOffset(tiff.get(), 0);
    levels.push_back(level);
  } while (TIFFReadDirectory(tiff.get()) != 0);
  return levels;
}

TEST_F(GeoTiffTest, TheLayoutIsCloudOptimised) {
  ASSERT_TRUE(WriteGeoTiff(cv::Mat1f(300, 1025, 1.5f), kPlace, {{"a", "b"}}, File()).ok());
  const std::vector<Level> levels = LevelsOf(File());
  ASSERT_EQ(levels.size(), 4U);
  EXPECT_EQ(levels[0].directory, 8U) << "right behind the header";
  for (size_t i = 0; i < levels.size(); ++i) {
    EXPECT_EQ(levels[i].is_reduced, i > 0);
    EXPECT_LT(levels[i].directory, levels.back().first_tile) << "directories come first";
    if (i == 0) continue;
    EXPECT_EQ(levels[i].width, (levels[i - 1].width + 1) / 2);
    EXPECT_EQ(levels[i].height, (levels[i - 1].height + 1) / 2);
    EXPECT_GT(levels[i].directory, levels[i - 1].directory);
    EXPECT_LT(levels[i].first_tile, levels[i - 1].first_tile) << "small ones come first";
  }
}

TEST_F(GeoTiffTest, OverviewsHoldTheMeans) {
  cv::Mat4b colours(300, 400, cv::Vec4b(10, 20, 30, 255));
  colours.colRange(200, 400).setTo(cv::Scalar::all(0));
  ASSERT_TRUE(WriteGeoTiff(colours, kPlace, {}, File()).ok());
  std::vector<cv::Mat> pages;
  ASSERT_TRUE(cv::imreadmulti(File(), pages, cv::IMREAD_UNCHANGED));
  ASSERT_EQ(pages.size(), 2U);
  const cv::Mat4b half = pages[1];
  ASSERT_EQ(half.size(), cv::Size(200, 150));
  EXPECT_EQ(half(149, 99), cv::Vec4b(10, 20, 30, 255));
  EXPECT_EQ(half(149, 100)[3], 0);
}

TEST_F(GeoTiffTest, ShadesComeBackAndZeroIsAHole) {
  cv::Mat1b shades(40, 30, uint8_t{181});
  shades(3, 4) = 0;
  ASSERT_TRUE(WriteGeoTiff(shades, kPlace, {}, File()).ok());
  const cv::Mat1b read = cv::imread(File(), cv::IMREAD_UNCHANGED);
  ASSERT_EQ(read.size(), shades.size());
  EXPECT_EQ(cv::countNonZero(read != shades), 0);
  EXPECT_EQ(TiffText(File(), 42113), "0");
}

TEST_F(GeoTiffTest, AWorldFileHoldsThePlaceWithoutAnOrigin) {
  const GridPlace place{std::nullopt, -12.5, 30, 0.25};
  ASSERT_TRUE(WriteGeoTiff(cv::Mat1f(10, 10, 0.0f), place, {}, File()).ok());
  const Bytes world = *ReadFile((folder_.path() / "grid.tfw").string());
  EXPECT_EQ(std::string(world.begin(), world.end()), "0.25\n0\n0\n-0.25\n-12.375\n29.875\n");
  const std::unique_ptr<TIFF, void (*)(TIFF*)> tiff(XTIFFOpen(File().c_str(), "r"), XTIFFClose);
  uint16_t count = 0;
  double* values = nullptr;
  EXPECT_EQ(TIFFGetField(tiff.get(), TIFFTAG_GEOTIEPOINTS, &count, &values), 0);
}

TEST_F(GeoTiffTest, ThereIsNoWorldFileOnTheEarth) {
  ASSERT_TRUE(WriteGeoTiff(cv::Mat1f(10, 10, 0.0f), kPlace, {}, File()).ok());
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "grid.tfw"));
}

TEST_F(GeoTiffTest, RefusesOtherPixelsAndAPathThatIsNone) {
  EXPECT_FALSE(WriteGeoTiff(cv::Mat3b(4, 4), kPlace, {}, File()).ok());
  EXPECT_FALSE(WriteGeoTiff(cv::Mat1f(), kPlace, {}, File()).ok());
  EXPECT_FALSE(
      WriteGeoTiff(cv::Mat1f(4, 4, 0.0f), kPlace, {}, folder_.path() / "no/grid.tif").ok());
}

TEST_F(GeoTiffTest, AFailureLeavesNoPartOfAFile) {
  std::filesystem::create_directories(folder_.path() / "grid.tif" / "full");
  EXPECT_FALSE(WriteGeoTiff(cv::Mat1f(4, 4, 0.0f), kPlace, {}, File()).ok());
  EXPECT_FALSE(std::filesystem::exists(File() + ".part"));
}

}  // namespace skein::geotiff_test
