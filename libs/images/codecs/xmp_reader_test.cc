#include "codecs/xmp_reader.h"

#include <gtest/gtest.h>

#include "codecs/exif_reader.h"
#include "testing/test_photos.h"

namespace skein::xmp_reader_test {

constexpr char kBegin[] =
    "<?xpacket begin=\"\xEF\xBB\xBF\" id=\"W5M0MpCehiHzreSzNTczkc9d\"?>\n"
    "<x:xmpmeta xmlns:x=\"adobe:ns:meta/\">\n"
    "<rdf:RDF xmlns:rdf=\"http://www.w3.org/1999/02/22-rdf-syntax-ns#\">\n";
constexpr char kEnd[] = "</rdf:RDF></x:xmpmeta>\n<?xpacket end=\"w\"?>";

// As the firmware of a Mavic 3 writes it.
const std::string kMavic = std::string(kBegin) +
                           R"(<rdf:Description rdf:about="DJI Meta Data"
    xmlns:tiff="http://ns.adobe.com/tiff/1.0/" xmlns:drone-dji="http://www.dji.com/drone-dji/1.0/"
    tiff:Make="DJI" drone-dji:AbsoluteAltitude="+519.12" drone-dji:RelativeAltitude="-4.30"
    drone-dji:GpsLatitude="-33.5100000" drone-dji:GpsLongitude="+151.2500000"
    drone-dji:GimbalYawDegree="-12.30"/>)" +
                           kEnd;

Bytes WithPacket(const Bytes& jpeg, const std::string& packet) {
  const std::string content = std::string("http://ns.adobe.com/xap/1.0/") + '\0' + packet;
  const size_t length = content.size() + 2;
  Bytes out(jpeg.begin(), jpeg.begin() + 2);
  out.insert(out.end(),
             {0xff, 0xe1, static_cast<uint8_t>(length >> 8), static_cast<uint8_t>(length)});
  out.insert(out.end(), content.begin(), content.end());
  out.insert(out.end(), jpeg.begin() + 2, jpeg.end());
  return out;
}

DronePosition Read(const std::string& packet) {
  return ReadDronePosition(WithPacket(SmallJpeg(), packet), PhotoFormat::kJpeg);
}

Exif ReadAll(const Bytes& photo) { return ReadExif(photo, *ReadPhotoHeader(photo)); }

ExifBuilder ExifPosition() {
  ExifBuilder exif;
  exif.Ascii(2, 1, "N");
  exif.Rationals(2, 2, {{48, 1}, {0, 1}, {0, 1}});
  exif.Ascii(2, 3, "E");
  exif.Rationals(2, 4, {{11, 1}, {0, 1}, {0, 1}});
  return exif;
}

TEST(DronePosition, IsReadFromAttributes) {
  const DronePosition position = Read(kMavic);
  EXPECT_EQ(position.latitude_deg, -33.51);
  EXPECT_EQ(position.longitude_deg, 151.25);
  EXPECT_EQ(position.altitude_m, 519.12);
  EXPECT_EQ(position.relative_altitude_m, -4.3);
}

TEST(DronePosition, IsReadFromElementsUnderAnyPrefixAndInTheOldSpelling) {
  const DronePosition position =
      Read(std::string(kBegin) +
           "<rdf:Description xmlns:d=\"http://www.dji.com/drone-dji/1.0/\">"
           "<d:GpsLatitude>+22.5</d:GpsLatitude><d:GpsLongtitude>114.25</d:GpsLongtitude>"
           "<d:RelativeAltitude>+70.1</d:RelativeAltitude></rdf:Description>" +
           kEnd);
  EXPECT_EQ(position.latitude_deg, 22.5);
  EXPECT_EQ(position.longitude_deg, 114.25);
  EXPECT_FALSE(position.altitude_m);
  EXPECT_EQ(position.relative_altitude_m, 70.1);
}

TEST(DronePosition, OfAnotherNamespaceIsNone) {
  std::string other = kMavic;
  other.replace(other.find("drone-dji/1.0/"), 14, "drone-xyz/1.0/");
  EXPECT_FALSE(Read(other).latitude_deg);
}

TEST(DronePosition, LeavesOutWhatMakesNoSense) {
  const auto with = [](const std::string& attributes) {
    return Read(std::string(kBegin) +
                "<rdf:Description xmlns:d=\"http://www.dji.com/drone-dji/1.0/\" " + attributes +
                "/>" + kEnd);
  };
  for (const char* text : {"", "x", "+", "1x", "nan", "inf", "1e999", "90.1", "-91", "++1"}) {
    EXPECT_FALSE(with(std::string("d:GpsLatitude=\"") + text + "\"").latitude_deg) << text;
  }
  EXPECT_EQ(with("d:GpsLatitude=\"90\"").latitude_deg, 90.0);
  EXPECT_FALSE(with("d:AbsoluteAltitude=\"1e6\"").altitude_m);
  const DronePosition no_fix = with("d:GpsLatitude=\"0.0\" d:GpsLongitude=\"+0.0\"");
  EXPECT_FALSE(no_fix.latitude_deg || no_fix.longitude_deg);
}

TEST(DronePosition, OfADamagedPacketIsWhatStandsBeforeTheDamage) {
  EXPECT_EQ(Read(kMavic.substr(0, kMavic.size() - 30)).latitude_deg, -33.51);
  EXPECT_FALSE(Read(kMavic.substr(0, 250)).latitude_deg);
  EXPECT_EQ(Read(kMavic + std::string(40, '\0')).latitude_deg, -33.51);
  EXPECT_FALSE(Read("").latitude_deg);
}

TEST(DronePosition, ExpandsNoEntities) {
  std::string laughs = "<!DOCTYPE x [<!ENTITY a \"ha\">";
  laughs += "<!ENTITY b \"&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;\">]>";
  EXPECT_FALSE(Read(laughs + kMavic.substr(kMavic.find("<x:"))).latitude_deg);
}

Bytes TiffWithPacket(const std::string& packet) {
  Bytes photo = {'I', 'I', 42, 0, 8, 0, 0, 0, 3, 0};
  const auto entry = [&](uint16_t tag, uint16_t type, uint32_t count, uint32_t value) {
    for (const uint32_t half : {uint32_t{tag}, uint32_t{type}}) {
      photo.push_back(static_cast<uint8_t>(half));
      photo.push_back(static_cast<uint8_t>(half >> 8));
    }
    for (const uint32_t word : {count, value}) {
      for (int shift = 0; shift < 32; shift += 8)
        photo.push_back(static_cast<uint8_t>(word >> shift));
    }
  };
  entry(256, 3, 1, 64);
  entry(257, 3, 1, 64);
  entry(700, 1, static_cast<uint32_t>(packet.size()), 8 + 2 + 3 * 12 + 4);
  photo.insert(photo.end(), 4, 0);
  photo.insert(photo.end(), packet.begin(), packet.end());
  return photo;
}

TEST(DronePosition, IsReadFromATiffToo) {
  Bytes photo = TiffWithPacket(kMavic);
  EXPECT_EQ(ReadDronePosition(photo, PhotoFormat::kTiff).relative_altitude_m, -4.3);
  photo.resize(photo.size() - 1);
  EXPECT_FALSE(ReadDronePosition(photo, PhotoFormat::kTiff).latitude_deg) << "it claims too much";
}

// Many attributes in a namespace with a long name, which Expat writes before each of them.
std::string LongNamespace(size_t size) {
  std::string packet = "<x xmlns:p=\"" + std::string(size / 2, 'u') + "\" ";
  for (int i = 0; packet.size() < size; ++i) packet += "p:a" + std::to_string(i) + "=\"\" ";
  return packet + "/>";
}

// A TIFF's packet is as large as its file: the long name would take minutes and 27 GB.
TEST(DronePosition, NoMoreOfAPacketIsReadThanAJpegHolds) {
  constexpr size_t kSegmentBytes = 64 << 10, kPacketBytes = 1 << 20;
  std::string nested;
  while (nested.size() < kPacketBytes) nested += "<a>";
  for (const std::string& bomb :
       {LongNamespace(kSegmentBytes - 100), LongNamespace(kPacketBytes), nested}) {
    EXPECT_FALSE(ReadDronePosition(TiffWithPacket(bomb), PhotoFormat::kTiff).latitude_deg);
  }
  for (const std::string& more : {LongNamespace(kPacketBytes), nested}) {
    const std::string packet = kMavic.substr(0, kMavic.find("</rdf:RDF>")) + more;
    EXPECT_EQ(ReadDronePosition(TiffWithPacket(packet), PhotoFormat::kTiff).latitude_deg, -33.51);
  }
}

TEST(DronePosition, FillsInWhatExifLacks) {
  const Exif bare = ReadAll(WithPacket(SmallJpeg(), kMavic));
  ASSERT_TRUE(bare.gps);
  EXPECT_EQ(bare.gps->latitude_deg, -33.51);
  EXPECT_EQ(bare.gps->altitude_m, 519.12);
  EXPECT_EQ(bare.gps->relative_altitude_m, -4.3);

  const Exif flat = ReadAll(WithPacket(ExifPosition().Into(SmallJpeg()), kMavic));
  EXPECT_EQ(flat.gps->latitude_deg, 48) << "EXIF's";
  EXPECT_EQ(flat.gps->altitude_m, 519.12);
  EXPECT_EQ(flat.gps->relative_altitude_m, -4.3);

  ExifBuilder high = ExifPosition();
  high.Rationals(2, 6, {{600, 1}});
  EXPECT_EQ(ReadAll(WithPacket(high.Into(SmallJpeg()), kMavic)).gps->altitude_m, 600);
}

}  // namespace skein::xmp_reader_test
