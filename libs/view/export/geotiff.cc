#include "export/geotiff.h"

#include <geotiff/geotiffio.h>
#include <geotiff/xtiffio.h>

#include <algorithm>
#include <iomanip>
#include <limits>
#include <map>
#include <memory>
#include <opencv2/imgproc.hpp>
#include <sstream>
#include <string>
#include <system_error>
#include <vector>

#include "core/file.h"
#include "export/local_projection.h"
#include "export/overviews.h"

namespace skein {
namespace {

namespace fs = std::filesystem;

constexpr int kTileSide = 256;
// GDAL's tags (gdal.org, GTiff driver): metadata as XML, the value of holes.
constexpr uint32_t kGdalMetadata = 42112, kGdalNoData = 42113;

TIFFExtendProc NextExtender();

void KnowGdalTags(TIFF* tiff) {
  static char metadata[] = "GDAL_METADATA", no_data[] = "GDAL_NODATA";
  static const TIFFFieldInfo info[] = {
      {kGdalMetadata, -1, -1, TIFF_ASCII, FIELD_CUSTOM, 1, 0, metadata},
      {kGdalNoData, -1, -1, TIFF_ASCII, FIELD_CUSTOM, 1, 0, no_data}};
  TIFFMergeFieldInfo(tiff, info, 2);
  if (const TIFFExtendProc next = NextExtender()) next(tiff);
}

// libtiff forgets a file's own tags with each directory that it reads. From the first call on
// KnowGdalTags therefore tells them to each file of the process, and calls the next extender.
TIFFExtendProc NextExtender() {
  static const TIFFExtendProc next = TIFFSetTagExtender(KnowGdalTags);
  return next;
}

using Tiff = std::unique_ptr<TIFF, void (*)(TIFF*)>;

Tiff OpenTiff(const fs::path& file) {
  NextExtender();
  return {XTIFFOpen(file.c_str(), "w"), XTIFFClose};
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

void SetMeaning(int type, TIFF* tiff) {
  const bool is_colour = type == CV_8UC4, is_height = type == CV_32FC1;
  TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, CV_MAT_CN(type));
  TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, is_height ? 32 : 8);
  TIFFSetField(tiff, TIFFTAG_SAMPLEFORMAT, is_height ? SAMPLEFORMAT_IEEEFP : SAMPLEFORMAT_UINT);
  TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, is_colour ? PHOTOMETRIC_RGB : PHOTOMETRIC_MINISBLACK);
  TIFFSetField(tiff, TIFFTAG_COMPRESSION, COMPRESSION_ADOBE_DEFLATE);
  TIFFSetField(tiff, TIFFTAG_PREDICTOR, is_height ? PREDICTOR_FLOATINGPOINT : PREDICTOR_HORIZONTAL);
  if (is_colour) {
    const uint16_t alpha = EXTRASAMPLE_UNASSALPHA;
    TIFFSetField(tiff, TIFFTAG_EXTRASAMPLES, 1, &alpha);
  } else {
    TIFFSetField(tiff, kGdalNoData, is_height ? "nan" : "0");
  }
}

void SetLayout(const cv::Mat& pixels, TIFF* tiff) {
  TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, pixels.cols);
  TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, pixels.rows);
  TIFFSetField(tiff, TIFFTAG_TILEWIDTH, kTileSide);
  TIFFSetField(tiff, TIFFTAG_TILELENGTH, kTileSide);
  TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
  SetMeaning(pixels.type(), tiff);
}

bool SetPlace(const GridPlace& place, TIFF* tiff) {
  if (!place.origin) return true;
  const double scale[] = {place.cell, place.cell, 0};
  const double corner[] = {0, 0, 0, place.west, place.north, 0};
  TIFFSetField(tiff, TIFFTAG_GEOPIXELSCALE, 3, scale);
  TIFFSetField(tiff, TIFFTAG_GEOTIEPOINTS, 6, corner);
  const std::unique_ptr<GTIF, void (*)(GTIF*)> keys(GTIFNew(tiff), GTIFFree);
  if (keys == nullptr) return false;
  SetLocalProjection(*place.origin, keys.get());
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

// libtiff's sequence for directories without their arrays of tiles (TIFFDeferStrileArrayWriting).
bool WriteDirectory(TIFF* tiff) {
  return TIFFDeferStrileArrayWriting(tiff) != 0 && TIFFWriteCheck(tiff, 1, "GeoTIFF") != 0 &&
         TIFFWriteDirectory(tiff) != 0;
}

bool WriteOverviewDirectory(const cv::Mat& pixels, TIFF* tiff) {
  if (TIFFCreateDirectory(tiff) != 0) return false;
  TIFFSetField(tiff, TIFFTAG_SUBFILETYPE, FILETYPE_REDUCEDIMAGE);
  SetLayout(pixels, tiff);
  return WriteDirectory(tiff);
}

bool GoTo(size_t level, TIFF* tiff) {
  return TIFFSetDirectory(tiff, static_cast<uint16_t>(level)) != 0;
}

// The arrays that tell where tiles lie, of zeros, for each directory. Tiles then come behind.
bool ReserveArrays(size_t num_levels, TIFF* tiff) {
  for (size_t level = 0; level < num_levels; ++level) {
    if (!GoTo(level, tiff) || TIFFForceStrileArrayWriting(tiff) == 0) return false;
  }
  return true;
}

bool WriteLevels(const std::vector<cv::Mat>& levels, TIFF* tiff) {
  for (size_t level = 1; level < levels.size(); ++level) {
    if (!WriteOverviewDirectory(levels[level], tiff)) return false;
  }
  if (!ReserveArrays(levels.size(), tiff)) return false;
  for (size_t level = levels.size(); level-- > 0;) {
    if (!GoTo(level, tiff) || !WriteTiles(levels[level], tiff) || TIFFFlush(tiff) == 0) {
      return false;
    }
  }
  return true;
}

bool WriteAll(const cv::Mat& stored, const GridPlace& place,
              const std::map<std::string, std::string>& metadata, TIFF* tiff) {
  SetLayout(stored, tiff);
  SetMetadata(metadata, tiff);
  return SetPlace(place, tiff) && WriteDirectory(tiff) &&
         WriteLevels(WithOverviews(stored, kTileSide), tiff);
}

// Six lines: x and y of a step by a column and by a row, middle of the first cell (ESRI).
Status WriteWorldFile(const GridPlace& place, fs::path file) {
  std::ostringstream lines;
  lines << std::setprecision(std::numeric_limits<double>::max_digits10);
  for (const double value : {place.cell, 0.0, 0.0, -place.cell, place.west + place.cell / 2,
                             place.north - place.cell / 2}) {
    lines << value << "\n";
  }
  return WriteFileAtomic(file.replace_extension(".tfw").string(), lines.str());
}

bool IsOfKnownType(const cv::Mat& pixels) {
  const int type = pixels.type();
  return !pixels.empty() && (type == CV_8UC4 || type == CV_32FC1 || type == CV_8UC1);
}

// A file of a disk that is full goes, too.
Status NotWritten(const fs::path& part, const std::string& why) {
  std::error_code ignored;
  fs::remove(part, ignored);
  return Unavailable("cannot write " + why);
}

// Into a file beside, which then takes the name.
Status WriteTiff(const cv::Mat& stored, const GridPlace& place,
                 const std::map<std::string, std::string>& metadata, const fs::path& file) {
  const fs::path part = file.string() + ".part";
  Tiff tiff = OpenTiff(part);
  if (tiff == nullptr) return Unavailable("cannot write " + part.string());
  const bool is_whole = WriteAll(stored, place, metadata, tiff.get());
  tiff.reset();
  if (!is_whole) return NotWritten(part, part.string() + ": is the disk full?");
  std::error_code error;
  fs::rename(part, file, error);
  if (error) return NotWritten(part, file.string() + ": " + error.message());
  return Status::Ok();
}

}  // namespace

Status WriteGeoTiff(const cv::Mat& pixels, const GridPlace& place,
                    const std::map<std::string, std::string>& metadata, const fs::path& file) {
  if (!IsOfKnownType(pixels)) {
    return InvalidArgument("a GeoTIFF is of colours with alpha, of heights, or of shades");
  }
  cv::Mat stored = pixels;
  if (pixels.type() == CV_8UC4) cv::cvtColor(pixels, stored, cv::COLOR_BGRA2RGBA);
  const Status written = WriteTiff(stored, place, metadata, file);
  if (!written.ok() || place.origin) return written;
  return WriteWorldFile(place, file);
}

}  // namespace skein
