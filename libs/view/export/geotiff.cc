#include "export/geotiff.h"

#include <geotiff/geotiffio.h>
#include <geotiff/xtiffio.h>

#include <algorithm>
#include <map>
#include <memory>
#include <opencv2/imgproc.hpp>
#include <string>
#include <system_error>
#include <vector>

#include "export/local_projection.h"

namespace skein {
namespace {

namespace fs = std::filesystem;

constexpr int kTileSide = 256;
// GDAL's tags (gdal.org, GTiff driver): metadata as XML, the value of holes.
constexpr uint32_t kGdalMetadata = 42112, kGdalNoData = 42113;

void KnowGdalTags(TIFF* tiff) {
  static char metadata[] = "GDAL_METADATA", no_data[] = "GDAL_NODATA";
  static const TIFFFieldInfo info[] = {
      {kGdalMetadata, -1, -1, TIFF_ASCII, FIELD_CUSTOM, 1, 0, metadata},
      {kGdalNoData, -1, -1, TIFF_ASCII, FIELD_CUSTOM, 1, 0, no_data}};
  TIFFMergeFieldInfo(tiff, info, 2);
}

std::string EscapedXml(const std::string& text) {
  static const std::map<char, std::string> kEscapes = {
      {'&', "&amp;"}, {'<', "&lt;"}, {'>', "&gt;"}, {'"', "&quot;"}};
  std::string escaped;
  for (const char c : text) {
    const auto escape = kEscapes.find(c);
    escaped += escape == kEscapes.end() ? std::string(1, c) : escape->second;
  }
  return escaped;
}

void SetMetadata(const std::map<std::string, std::string>& metadata, TIFF* tiff) {
  if (metadata.empty()) return;
  std::string xml = "<GDALMetadata>\n";
  for (const auto& [name, value] : metadata) {
    xml += "  <Item name=\"" + EscapedXml(name) + "\">" + EscapedXml(value) + "</Item>\n";
  }
  TIFFSetField(tiff, kGdalMetadata, (xml + "</GDALMetadata>\n").c_str());
}

void SetLayout(const cv::Mat& pixels, TIFF* tiff) {
  const bool is_colour = pixels.type() == CV_8UC4;
  TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, pixels.cols);
  TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, pixels.rows);
  TIFFSetField(tiff, TIFFTAG_TILEWIDTH, kTileSide);
  TIFFSetField(tiff, TIFFTAG_TILELENGTH, kTileSide);
  TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, pixels.channels());
  TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, is_colour ? 8 : 32);
  TIFFSetField(tiff, TIFFTAG_SAMPLEFORMAT, is_colour ? SAMPLEFORMAT_UINT : SAMPLEFORMAT_IEEEFP);
  TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, is_colour ? PHOTOMETRIC_RGB : PHOTOMETRIC_MINISBLACK);
  TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
  TIFFSetField(tiff, TIFFTAG_COMPRESSION, COMPRESSION_ADOBE_DEFLATE);
  TIFFSetField(tiff, TIFFTAG_PREDICTOR, is_colour ? PREDICTOR_HORIZONTAL : PREDICTOR_FLOATINGPOINT);
  if (is_colour) {
    const uint16_t alpha = EXTRASAMPLE_UNASSALPHA;
    TIFFSetField(tiff, TIFFTAG_EXTRASAMPLES, 1, &alpha);
  } else {
    TIFFSetField(tiff, kGdalNoData, "nan");
  }
}

bool SetPlace(const GridPlace& place, TIFF* tiff) {
  const double scale[] = {place.cell_m, place.cell_m, 0};
  const double corner[] = {0, 0, 0, place.west_m, place.north_m, 0};
  TIFFSetField(tiff, TIFFTAG_GEOPIXELSCALE, 3, scale);
  TIFFSetField(tiff, TIFFTAG_GEOTIEPOINTS, 6, corner);
  const std::unique_ptr<GTIF, void (*)(GTIF*)> keys(GTIFNew(tiff), GTIFFree);
  if (keys == nullptr) return false;
  SetLocalProjection(place.origin, keys.get());
  GTIFKeySet(keys.get(), GTRasterTypeGeoKey, TYPE_SHORT, 1, static_cast<int>(RasterPixelIsArea));
  return GTIFWriteKeys(keys.get()) != 0;
}

bool WriteTiles(const cv::Mat& pixels, TIFF* tiff) {
  cv::Mat tile(kTileSide, kTileSide, pixels.type());
  for (int y = 0; y < pixels.rows; y += kTileSide) {
    for (int x = 0; x < pixels.cols; x += kTileSide) {
      const cv::Rect part(x, y, std::min(kTileSide, pixels.cols - x),
                          std::min(kTileSide, pixels.rows - y));
      tile.setTo(cv::Scalar::all(0));
      pixels(part).copyTo(tile(cv::Rect({0, 0}, part.size())));
      const auto bytes = static_cast<tmsize_t>(tile.total() * tile.elemSize());
      const uint32_t index = TIFFComputeTile(tiff, x, y, 0, 0);
      if (TIFFWriteEncodedTile(tiff, index, tile.data, bytes) < 0) return false;
    }
  }
  return true;
}

}  // namespace

Status WriteGeoTiff(const cv::Mat& pixels, const GridPlace& place,
                    const std::map<std::string, std::string>& metadata, const fs::path& file) {
  const bool is_colour = pixels.type() == CV_8UC4;
  if (pixels.empty() || (!is_colour && pixels.type() != CV_32FC1)) {
    return InvalidArgument("a GeoTIFF is of colours with alpha, or of heights");
  }
  cv::Mat stored = pixels;
  if (is_colour) cv::cvtColor(pixels, stored, cv::COLOR_BGRA2RGBA);
  const fs::path part = file.string() + ".part";
  const std::unique_ptr<TIFF, void (*)(TIFF*)> tiff(XTIFFOpen(part.c_str(), "w"), XTIFFClose);
  if (tiff == nullptr) return Unavailable("cannot write " + part.string());
  KnowGdalTags(tiff.get());
  SetLayout(stored, tiff.get());
  SetMetadata(metadata, tiff.get());
  const bool is_whole =
      SetPlace(place, tiff.get()) && WriteTiles(stored, tiff.get()) && TIFFFlush(tiff.get()) != 0;
  if (!is_whole) return Unavailable("cannot write " + part.string() + ": is the disk full?");
  std::error_code error;
  fs::rename(part, file, error);
  if (error) return Unavailable("cannot write " + file.string() + ": " + error.message());
  return Status::Ok();
}

}  // namespace skein
