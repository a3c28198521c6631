#include "export/geotiff.h"

#include <geotiff/geotiffio.h>
#include <geotiff/xtiffio.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <opencv2/imgcodecs.hpp>
#include <string>

#include "testing/test_folder.h"
#include "testing/test_tiff.h"

namespace skein::geotiff_test {

const GridPlace kPlace{{47.5, 8.25, 400.0}, -12.5, 30, 0.25};

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

TEST_F(GeoTiffTest, RefusesOtherPixelsAndAPathThatIsNone) {
  EXPECT_FALSE(WriteGeoTiff(cv::Mat3b(4, 4), kPlace, {}, File()).ok());
  EXPECT_FALSE(WriteGeoTiff(cv::Mat1f(), kPlace, {}, File()).ok());
  EXPECT_FALSE(
      WriteGeoTiff(cv::Mat1f(4, 4, 0.0f), kPlace, {}, folder_.path() / "no/grid.tif").ok());
}

}  // namespace skein::geotiff_test
