#include "codecs/xmp_reader.h"

#include <expat.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <map>
#include <memory>
#include <string>
#include <type_traits>

#include "photo/exif.h"
#include "photo/tiff_directory.h"

namespace skein {
namespace {

constexpr char kSegmentId[] = "http://ns.adobe.com/xap/1.0/";  // and its terminating zero
constexpr char kNamespace[] = "http://www.dji.com/drone-dji/1.0/";
constexpr char kSeparator = ' ';  // between a name's namespace and the rest
constexpr uint32_t kXmpTag = 700;
// As a JPEG's segment holds it. Expat writes a namespace's whole name before each attribute of it:
// of 64 KiB that takes 0.4 s and 110 MB, of 1 MiB minutes and 27 GB.
constexpr size_t kMaxPacketBytes = 64 << 10;
constexpr size_t kMaxValueBytes = 64;

ByteView PacketOfJpeg(ByteView jpeg) {
  for (size_t at = 2; at + 4 <= jpeg.size() && jpeg[at] == 0xff && jpeg[at + 1] != 0xda;) {
    const size_t length = size_t{jpeg[at + 2]} << 8 | jpeg[at + 3];
    if (length < 2 || length > jpeg.size() - at - 2) break;
    const uint8_t* content = jpeg.data() + at + 4;
    const size_t size = length - 2;
    if (jpeg[at + 1] == 0xe1 && size >= sizeof(kSegmentId) &&
        std::memcmp(content, kSegmentId, sizeof(kSegmentId)) == 0) {
      return {content + sizeof(kSegmentId), size - sizeof(kSegmentId)};
    }
    at += 2 + length;
  }
  return {nullptr, 0};
}

ByteView PacketOf(ByteView photo, PhotoFormat format) {
  if (format == PhotoFormat::kJpeg) return PacketOfJpeg(photo);
  if (format == PhotoFormat::kTiff) return TiffDirectory(photo).FindBytes(kXmpTag);
  return {nullptr, 0};
}

// Values of the properties in DJI's namespace, by their names there; the first of each.
class PropertyReader {
 public:
  std::map<std::string, std::string> Read(ByteView packet) {
    const auto size = static_cast<int>(std::min(packet.size(), kMaxPacketBytes));
    XML_SetUserData(parser_.get(), this);
    XML_SetElementHandler(parser_.get(), OnStart, OnEnd);
    XML_SetCharacterDataHandler(parser_.get(), OnText);
    XML_SetStartDoctypeDeclHandler(parser_.get(), OnDoctype);
    // A packet that ends early or is padded with zeros has told what it tells by then.
    XML_Parse(parser_.get(), reinterpret_cast<const char*>(packet.data()), size, XML_TRUE);
    return std::move(values_);
  }

 private:
  static PropertyReader& Self(void* data) { return *static_cast<PropertyReader*>(data); }

  // "" where it is none of DJI's.
  static std::string NameOf(const char* qualified) {
    constexpr size_t kLength = sizeof(kNamespace) - 1;
    const bool is_ours = std::strncmp(qualified, kNamespace, kLength) == 0;
    return is_ours && qualified[kLength] == kSeparator ? qualified + kLength + 1 : "";
  }

  void Add(const std::string& name, const std::string& value) {
    if (!name.empty()) values_.emplace(name.substr(0, kMaxValueBytes), value);
  }

  static void OnStart(void* data, const char* name, const char** attributes) {
    PropertyReader& self = Self(data);
    for (; attributes[0] != nullptr; attributes += 2)
      self.Add(NameOf(attributes[0]), attributes[1]);
    self.element_ = NameOf(name);
    self.text_.clear();
  }
  static void OnText(void* data, const char* text, int length) {
    PropertyReader& self = Self(data);
    const size_t room = kMaxValueBytes - std::min(kMaxValueBytes, self.text_.size());
    if (!self.element_.empty()) self.text_.append(text, std::min<size_t>(length, room));
  }
  static void OnEnd(void* data, const char*) {
    PropertyReader& self = Self(data);
    self.Add(self.element_, self.text_);
    self.element_.clear();
  }
  static void OnDoctype(void* data, const char*, const char*, const char*, int) {
    XML_StopParser(Self(data).parser_.get(), XML_FALSE);
  }

  const std::unique_ptr<std::remove_pointer_t<XML_Parser>, decltype(&XML_ParserFree)> parser_{
      XML_ParserCreateNS(nullptr, kSeparator), XML_ParserFree};
  std::map<std::string, std::string> values_;
  std::string element_, text_;
};

// "+519.12"; nothing where more follows, or beyond the limit.
std::optional<double> Number(const std::map<std::string, std::string>& values, const char* name,
                             double limit) {
  const auto found = values.find(name);
  if (found == values.end()) return std::nullopt;
  const char* begin = found->second.data();
  const char* const end = begin + found->second.size();
  if (begin != end && *begin == '+') ++begin;
  double value = 0;
  const auto [read_to, error] = std::from_chars(begin, end, value);
  if (error != std::errc() || read_to != end || !(std::abs(value) <= limit)) return std::nullopt;
  return value;
}

}  // namespace

DronePosition ReadDronePosition(ByteView photo, PhotoFormat format) {
  DronePosition position;
  const ByteView packet = PacketOf(photo, format);
  if (packet.size() == 0) return position;
  const auto values = PropertyReader().Read(packet);
  position.latitude_deg = Number(values, "GpsLatitude", 90);
  position.longitude_deg = Number(values, "GpsLongitude", 180);
  // As the firmware of older drones spells it.
  if (!position.longitude_deg) position.longitude_deg = Number(values, "GpsLongtitude", 180);
  if (position.latitude_deg == 0.0 && position.longitude_deg == 0.0) {
    position.latitude_deg = position.longitude_deg = std::nullopt;
  }
  position.altitude_m = Number(values, "AbsoluteAltitude", kHighestM);
  position.relative_altitude_m = Number(values, "RelativeAltitude", kHighestM);
  return position;
}

}  // namespace skein
