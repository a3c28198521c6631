#include "codecs/exif_reader.h"

#include <libexif/exif-data.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <memory>

#include "codecs/xmp_reader.h"
#include "sfm/sensor_width.h"

namespace skein {
namespace {

// Encoders and rounding cut off less of a side.
constexpr double kLeastCrop = 0.01;
// Ratio of two focal lengths that EXIF tells of one photo from which on one of them is wrong. The
// sensors of one phone's cameras differ by less: 2.3 between a main camera and a periscope.
constexpr double kMaxFocalRatio = 3;

using ExifHandle = std::unique_ptr<ExifData, decltype(&exif_data_unref)>;

ExifHandle Parse(const uint8_t* data, size_t size) {
  return {exif_data_new_from_data(data, static_cast<unsigned>(size)), exif_data_unref};
}

// libexif wants the marker that JPEG puts before the block.
ExifHandle ParseBare(const uint8_t* tiff, size_t size) {
  Bytes marked = {'E', 'x', 'i', 'f', 0, 0};
  marked.insert(marked.end(), tiff, tiff + size);
  return Parse(marked.data(), marked.size());
}

ExifHandle ParsePng(ByteView bytes) {
  for (size_t at = 8; at + 12 <= bytes.size();) {
    const size_t length = size_t{bytes[at]} << 24 | size_t{bytes[at + 1]} << 16 |
                          size_t{bytes[at + 2]} << 8 | bytes[at + 3];
    if (length > bytes.size() - at - 12) break;
    const std::string type(bytes.begin() + at + 4, bytes.begin() + at + 8);
    if (type == "eXIf") return ParseBare(bytes.data() + at + 8, length);
    at += 12 + length;
  }
  return {nullptr, exif_data_unref};
}

ExifHandle Load(ByteView bytes, PhotoFormat format) {
  switch (format) {
    case PhotoFormat::kJpeg:
      return Parse(bytes.data(), bytes.size());
    case PhotoFormat::kPng:
      return ParsePng(bytes);
    case PhotoFormat::kTiff:
      return ParseBare(bytes.data(), bytes.size());
  }
  return {nullptr, exif_data_unref};
}

// Typed access to one block.
class ExifReader {
 public:
  explicit ExifReader(ExifData* data)
      : data_(data),
        order_(data == nullptr ? EXIF_BYTE_ORDER_INTEL : exif_data_get_byte_order(data)) {}

  std::optional<int> Short(ExifIfd ifd, ExifTag tag) const {
    const ExifEntry* entry = Find(ifd, tag);
    if (entry == nullptr || entry->components < 1) return std::nullopt;
    if (entry->format == EXIF_FORMAT_SHORT && entry->size >= 2) {
      return exif_get_short(entry->data, order_);
    }
    if (entry->format == EXIF_FORMAT_LONG && entry->size >= 4) {
      return static_cast<int>(exif_get_long(entry->data, order_));
    }
    return std::nullopt;
  }

  std::optional<double> Rational(ExifIfd ifd, ExifTag tag, size_t index = 0) const {
    const ExifEntry* entry = Find(ifd, tag);
    if (entry == nullptr || entry->format != EXIF_FORMAT_RATIONAL) return std::nullopt;
    if (entry->size < 8 * (index + 1)) return std::nullopt;
    const ExifRational value = exif_get_rational(entry->data + 8 * index, order_);
    if (value.denominator == 0) return std::nullopt;
    return static_cast<double>(value.numerator) / value.denominator;
  }

  std::string Ascii(ExifIfd ifd, ExifTag tag) const {
    const ExifEntry* entry = Find(ifd, tag);
    if (entry == nullptr || entry->format != EXIF_FORMAT_ASCII) return "";
    std::string text(reinterpret_cast<const char*>(entry->data), entry->size);
    text = text.substr(0, text.find('\0'));
    text.erase(text.find_last_not_of(' ') + 1);
    return text;
  }

  std::optional<int> Byte(ExifIfd ifd, ExifTag tag) const {
    const ExifEntry* entry = Find(ifd, tag);
    if (entry == nullptr || entry->size < 1) return std::nullopt;
    return entry->data[0];
  }

 private:
  const ExifEntry* Find(ExifIfd ifd, ExifTag tag) const {
    if (data_ == nullptr || data_->ifd[ifd] == nullptr) return nullptr;
    const ExifEntry* entry = exif_content_get_entry(data_->ifd[ifd], tag);
    return entry != nullptr && entry->data != nullptr ? entry : nullptr;
  }

  ExifData* data_;
  ExifByteOrder order_;
};

constexpr ExifTag GpsTag(int tag) { return static_cast<ExifTag>(tag); }

std::optional<double> DegreesAt(const ExifReader& exif, int tag, char negative, double limit_deg) {
  const auto degrees = exif.Rational(EXIF_IFD_GPS, GpsTag(tag), 0);
  if (!degrees) return std::nullopt;
  const double minutes = exif.Rational(EXIF_IFD_GPS, GpsTag(tag), 1).value_or(0);
  const double seconds = exif.Rational(EXIF_IFD_GPS, GpsTag(tag), 2).value_or(0);
  const double value = *degrees + minutes / 60 + seconds / 3600;
  if (value > limit_deg) return std::nullopt;
  const std::string reference = exif.Ascii(EXIF_IFD_GPS, GpsTag(tag - 1));
  return !reference.empty() && reference[0] == negative ? -value : value;
}

std::optional<GpsPosition> ReadGps(const ExifReader& exif) {
  const auto latitude = DegreesAt(exif, EXIF_TAG_GPS_LATITUDE, 'S', 90);
  const auto longitude = DegreesAt(exif, EXIF_TAG_GPS_LONGITUDE, 'W', 180);
  if (!latitude || !longitude) return std::nullopt;
  // Receivers without a fix write zeros.
  if (*latitude == 0 && *longitude == 0) return std::nullopt;
  GpsPosition gps{*latitude, *longitude, {}, {}};
  gps.altitude_m = exif.Rational(EXIF_IFD_GPS, GpsTag(EXIF_TAG_GPS_ALTITUDE));
  const bool is_below_sea =
      exif.Byte(EXIF_IFD_GPS, GpsTag(EXIF_TAG_GPS_ALTITUDE_REF)).value_or(0) == 1;
  if (gps.altitude_m && is_below_sea) *gps.altitude_m *= -1;
  return gps;
}

// What EXIF lacks is a drone's own word.
void AddDronePosition(const DronePosition& drone, std::optional<GpsPosition>* gps) {
  if (!*gps && drone.latitude_deg && drone.longitude_deg) {
    *gps = GpsPosition{*drone.latitude_deg, *drone.longitude_deg, {}, {}};
  }
  if (!*gps) return;
  if (!(*gps)->altitude_m) (*gps)->altitude_m = drone.altitude_m;
  (*gps)->relative_altitude_m = drone.relative_altitude_m;
}

int64_t SubsecondsUs(const std::string& digits) {
  int64_t value = 0, unit = 1000000;
  for (const char c : digits) {
    if (c < '0' || c > '9' || unit == 1) break;
    unit /= 10;
    value += (c - '0') * unit;
  }
  return value;
}

// "+02:00" -> 7200
int64_t OffsetSeconds(const std::string& text) {
  char sign = 0;
  int hours = 0, minutes = 0;
  if (std::sscanf(text.c_str(), "%c%2d:%2d", &sign, &hours, &minutes) != 3) return 0;
  const int64_t seconds = hours * 3600 + minutes * 60;
  return sign == '-' ? -seconds : sign == '+' ? seconds : 0;
}

int64_t ReadCaptureTime(const ExifReader& exif) {
  std::tm time{};
  const std::string text = exif.Ascii(EXIF_IFD_EXIF, EXIF_TAG_DATE_TIME_ORIGINAL);
  if (std::sscanf(text.c_str(), "%4d:%2d:%2d %2d:%2d:%2d", &time.tm_year, &time.tm_mon,
                  &time.tm_mday, &time.tm_hour, &time.tm_min, &time.tm_sec) != 6) {
    return 0;
  }
  if (time.tm_year < 1970 || time.tm_mon < 1 || time.tm_mon > 12) return 0;
  time.tm_year -= 1900;
  time.tm_mon -= 1;
  const int64_t offset = OffsetSeconds(exif.Ascii(EXIF_IFD_EXIF, static_cast<ExifTag>(0x9011)));
  return (static_cast<int64_t>(timegm(&time)) - offset) * 1000000 +
         SubsecondsUs(exif.Ascii(EXIF_IFD_EXIF, EXIF_TAG_SUB_SEC_TIME_ORIGINAL));
}

// FocalPlaneResolutionUnit: 2 inch (the default), 3 cm; 4 mm and 5 um are in use, too.
double MmPerUnit(int unit) {
  switch (unit) {
    case 3:
      return 10;
    case 4:
      return 1;
    case 5:
      return 1e-3;
    default:
      return 25.4;
  }
}

// The photo as the camera wrote it, at the scale at which it is stored.
struct WholePhoto {
  double longer_px = 0, shorter_px = 0;
  bool is_certain = true;
};

WholePhoto FindWholePhoto(const ExifReader& exif, const PhotoHeader& header) {
  const auto [shorter, longer] = std::minmax(header.width_px, header.height_px);
  WholePhoto whole{static_cast<double>(longer), static_cast<double>(shorter), true};
  const double exif_width = exif.Short(EXIF_IFD_EXIF, EXIF_TAG_PIXEL_X_DIMENSION).value_or(0);
  const double exif_height = exif.Short(EXIF_IFD_EXIF, EXIF_TAG_PIXEL_Y_DIMENSION).value_or(0);
  const auto [exif_shorter, exif_longer] = std::minmax(exif_width, exif_height);
  if (!(exif_shorter > 0)) return whole;
  const double scale = whole.longer_px / exif_longer;
  if (std::abs(scale * exif_shorter / whole.shorter_px - 1) < kLeastCrop) return whole;
  const bool is_unscaled = (whole.longer_px == exif_longer && whole.shorter_px < exif_shorter) ||
                           (whole.shorter_px == exif_shorter && whole.longer_px < exif_longer);
  const double least_scale = is_unscaled ? 1 : std::max(scale, whole.shorter_px / exif_shorter);
  return {least_scale * exif_longer, least_scale * exif_shorter, is_unscaled};
}

// Width in mm of the part of the sensor that became the longer side of the camera's photo, without
// digital zoom.
std::optional<double> SensorWidthMm(const ExifReader& exif, const Exif& info,
                                    const PhotoHeader& header) {
  const auto resolution = exif.Rational(EXIF_IFD_EXIF, EXIF_TAG_FOCAL_PLANE_X_RESOLUTION);
  if (resolution && *resolution > 0) {
    const int unit = exif.Short(EXIF_IFD_EXIF, EXIF_TAG_FOCAL_PLANE_RESOLUTION_UNIT).value_or(2);
    const auto full_width = exif.Short(EXIF_IFD_EXIF, EXIF_TAG_PIXEL_X_DIMENSION);
    const auto full_height = exif.Short(EXIF_IFD_EXIF, EXIF_TAG_PIXEL_Y_DIMENSION);
    const double longer = std::max<double>(full_width.value_or(header.width_px),
                                           full_height.value_or(header.height_px));
    return longer / *resolution * MmPerUnit(unit);
  }
  if (info.make.empty()) return std::nullopt;
  return FindSensorWidthMm(info.make, info.model);
}

int OrientationOf(const ExifReader& exif) {
  const int orientation = exif.Short(EXIF_IFD_0, EXIF_TAG_ORIENTATION).value_or(1);
  return orientation >= 1 && orientation <= 8 ? orientation : 1;
}

// 1 if there was none, or the tag is absent or absurd.
double ReadDigitalZoom(const ExifReader& exif) {
  const double zoom = exif.Rational(EXIF_IFD_EXIF, EXIF_TAG_DIGITAL_ZOOM_RATIO).value_or(1);
  return zoom > 1 && zoom < 100 ? zoom : 1;
}

double RatioOf(double a, double b) { return std::max(a, b) / std::min(a, b); }

// Sets focal length and digital zoom. A 35 mm equivalent that contradicts the focal length in mm
// counts if it is nearer to the longer side. (The sensor's width is as often wrong: editors that
// shrink a photo leave its resolution in the focal plane.) Else the focal length is a guess.
void ReadFocal(const ExifReader& exif, const PhotoHeader& header, Exif* info) {
  const double longer_px = static_cast<double>(std::max(header.width_px, header.height_px));
  info->digital_zoom = ReadDigitalZoom(exif);
  const WholePhoto whole = FindWholePhoto(exif, header);
  bool is_certain = whole.is_certain;
  const int focal35_mm = exif.Short(EXIF_IFD_EXIF, EXIF_TAG_FOCAL_LENGTH_IN_35MM_FILM).value_or(0);
  const double focal_mm = exif.Rational(EXIF_IFD_EXIF, EXIF_TAG_FOCAL_LENGTH).value_or(0);
  const std::optional<double> width_mm = SensorWidthMm(exif, *info, header);
  const double by_sensor_px =
      width_mm && *width_mm > 0 ? focal_mm / *width_mm * whole.longer_px : 0;
  double focal_px = by_sensor_px * info->digital_zoom;
  if (focal35_mm > 0) {
    focal_px = focal35_mm * std::hypot(whole.longer_px, whole.shorter_px) / kFullFrameDiagonalMm;
    if (by_sensor_px > 0 && focal_px < by_sensor_px * std::sqrt(info->digital_zoom)) {
      focal_px *= info->digital_zoom;
    }
    is_certain &= info->digital_zoom == 1 || by_sensor_px > 0;
    const double other_px = by_sensor_px * info->digital_zoom;
    if (other_px > 0 && RatioOf(focal_px, other_px) > kMaxFocalRatio &&
        RatioOf(other_px, longer_px) < RatioOf(focal_px, longer_px)) {
      focal_px = other_px;
      is_certain = false;
    }
  }
  if (!(focal_px > 0.1 * longer_px) || !(focal_px < 100 * longer_px)) return;
  info->focal_px = focal_px;
  info->focal_is_guess = !is_certain;
}

}  // namespace

int ReadOrientation(ByteView bytes, PhotoFormat format) {
  const ExifHandle handle = Load(bytes, format);
  return OrientationOf(ExifReader(handle.get()));
}

Exif ReadExif(ByteView bytes, const PhotoHeader& header) {
  const ExifHandle handle = Load(bytes, header.format);
  const ExifReader exif(handle.get());
  Exif info;
  info.orientation = OrientationOf(exif);
  info.make = exif.Ascii(EXIF_IFD_0, EXIF_TAG_MAKE);
  info.model = exif.Ascii(EXIF_IFD_0, EXIF_TAG_MODEL);
  ReadFocal(exif, header, &info);
  info.capture_utime_us = ReadCaptureTime(exif);
  info.gps = ReadGps(exif);
  AddDronePosition(ReadDronePosition(bytes, header.format), &info.gps);
  return info;
}

}  // namespace skein
