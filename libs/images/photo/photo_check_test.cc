#include "photo/photo_check.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <string>

#include "testing/test_bombs.h"

namespace skein::photo_check_test {

// Without tables or data of any sense: what is to be known without decoding.
Bytes JpegWithScans(int num_scans) {
  Bytes jpeg = {0xff, 0xd8};
  // A preview, as cameras store it, has scans of its own.
  const Bytes preview = {0xff, 0xd8, 0xff, 0xda, 0, 2, 1, 0xff, 0xd9};
  jpeg.insert(jpeg.end(), {0xff, 0xe1, 0, static_cast<uint8_t>(2 + preview.size())});
  jpeg.insert(jpeg.end(), preview.begin(), preview.end());
  jpeg.insert(jpeg.end(), {0xff, 0xc2, 0, 11, 8, 0, 100, 0, 100, 1, 1, 0x11, 0});
  for (int i = 0; i < num_scans; ++i) {
    jpeg.insert(jpeg.end(), {0xff, 0xff, 0xda, 0, 8, 1, 1, 0, 0, 0, 0});
    jpeg.insert(jpeg.end(), {1, 0xff, 0, 0xda, 0xff, 0xd0, 2, 3});  // stuffing, a restart
  }
  jpeg.insert(jpeg.end(), {0xff, 0xd9, 0xff, 0xda, 0, 2});
  return jpeg;
}

TEST(PhotoHeader, CountsTheScansOfAJpeg) {
  EXPECT_EQ(CountJpegScans(JpegWithScans(0), 9), 0);
  EXPECT_EQ(CountJpegScans(JpegWithScans(7), 9), 7);
  EXPECT_EQ(CountJpegScans(JpegWithScans(12), 9), 9);
  const Bytes whole = JpegWithScans(3);
  for (size_t size = 0; size <= whole.size(); ++size) {
    EXPECT_LE(CountJpegScans(ByteView(whole.data(), size), 9), 3) << size;
  }
}

PhotoFault FaultOfFile(const Bytes& file, const PhotoLimits& limits = {}) {
  return FaultOf(CheckHeader(file, limits).code(), file);
}

TEST(PhotoCheck, TellsTheKindOfARefusal) {
  const Bytes jpeg = JpegWithScans(1);  // 100 x 100
  PhotoLimits limits;
  limits.min_side_px = 200;
  EXPECT_EQ(FaultOfFile(jpeg, limits), PhotoFault::kTooSmall);
  limits = {};
  limits.max_pixels = 5000;
  EXPECT_EQ(FaultOfFile(jpeg, limits), PhotoFault::kTooLarge);
  limits = {};
  limits.max_bytes = 10;
  EXPECT_EQ(FaultOfFile(jpeg, limits), PhotoFault::kTooLarge);
  EXPECT_EQ(FaultOfFile({}), PhotoFault::kUnreadable);
  EXPECT_EQ(FaultOfFile(Bytes(jpeg.begin(), jpeg.begin() + 20)), PhotoFault::kUnreadable);
  EXPECT_EQ(FaultOfFile({'h', 'e', 'l', 'l', 'o'}), PhotoFault::kUnreadable);
  const Bytes heic = {0, 0, 0, 16, 'f', 't', 'y', 'p', 'h', 'e', 'i', 'c', 0, 0, 0, 0};
  EXPECT_EQ(FaultOfFile(heic), PhotoFault::kPhoneFormat);
  EXPECT_EQ(FaultOf(StatusCode::kInternal, jpeg), PhotoFault::kOther);
}

TEST(PhotoCheck, RefusesAJpegWithFarTooManyScans) {
  EXPECT_TRUE(CheckHeader(JpegWithScans(kMaxJpegScans), PhotoLimits()).ok());
  const auto header = CheckHeader(JpegWithScans(kMaxJpegScans + 1), PhotoLimits());
  EXPECT_EQ(header.error(), "the JPEG has more than 100 scans");
}

// A PNG of that size, without pixels.
Bytes PngOf(uint32_t width_px, uint32_t height_px, const Bytes& chunks) {
  Bytes header, png = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
  AppendBigEndian(width_px, &header);
  AppendBigEndian(height_px, &header);
  header.insert(header.end(), {8, 2, 0, 0, 0});
  for (const Bytes& part : {PngChunk("IHDR", header), chunks, PngChunk("IEND", {})}) {
    png.insert(png.end(), part.begin(), part.end());
  }
  return png;
}

Bytes Texts(const std::string& type, int count) {
  Bytes chunks;
  for (int i = 0; i < count; ++i) {
    const Bytes chunk = PngChunk(type, {'k', 0, 0});
    chunks.insert(chunks.end(), chunk.begin(), chunk.end());
  }
  return chunks;
}

TEST(PhotoCheck, RefusesAPngWithFarTooManyTexts) {
  for (const char* type : {"zTXt", "iTXt", "iCCP"}) {
    EXPECT_TRUE(CheckHeader(PngOf(100, 100, Texts(type, kMaxPngTexts)), PhotoLimits()).ok());
    const auto header = CheckHeader(PngOf(100, 100, Texts(type, kMaxPngTexts + 1)), PhotoLimits());
    EXPECT_EQ(header.error(), "the PNG has more than 32 compressed texts") << type;
  }
  EXPECT_TRUE(CheckHeader(PngOf(100, 100, Texts("tEXt", 1000)), PhotoLimits()).ok());
  Bytes behind_its_end = PngOf(100, 100, {});
  const Bytes texts = Texts("zTXt", 100);
  behind_its_end.insert(behind_its_end.end(), texts.begin(), texts.end());
  EXPECT_EQ(CountPngTexts(behind_its_end, 1000), 0);
  const Bytes whole = PngOf(100, 100, Texts("zTXt", 3));
  for (size_t size = 0; size <= whole.size(); ++size) {
    EXPECT_LE(CountPngTexts(ByteView(whole.data(), size), 9), 3) << size;
  }
}

TEST(PhotoCheck, RefusesAPngOfAThousandBytesThatClaimsGigapixels) {
  const Bytes png = PngOf(60'000, 60'000, Texts("IDAT", 60));
  EXPECT_LT(png.size(), 1024u);
  EXPECT_EQ(CheckHeader(png, PhotoLimits()).error(),
            "header claims 60000 x 60000 pixels, more than 100 megapixels");
}

TEST(PhotoCheck, NamesFormatsThatAreOftenCalledJpg) {
  const std::map<std::string, std::string> formats = {{"GIF89a", "GIF"},
                                                      {"RIFFxxxxWEBP", "WebP"},
                                                      {"xxxxjP  ", "JPEG 2000"},
                                                      {"xxxxJXL ", "JPEG XL"},
                                                      {"\xff\x0a", "JPEG XL"}};
  for (const auto& [head, name] : formats) {
    EXPECT_EQ(CheckHeader(Bytes(head.begin(), head.end()), PhotoLimits()).error(),
              name + " image, whatever its name says: JPEG, PNG and TIFF are taken");
  }
}

TEST(PhotoCheck, OtherFormatsAreNotLookedInto) {
  for (const std::string head : {"BM", "8BPS", "II+", "RIFFxxxxWAVE", "RIFF", "GIF", "<svg"}) {
    Bytes file(head.begin(), head.end());
    file.resize(1000);
    EXPECT_EQ(CheckHeader(file, PhotoLimits()).error(), "not a JPEG, PNG or TIFF photo") << head;
  }
}

TEST(FocalPrior, PrefersExifThenTheOfferThenTheSize) {
  CheckedPhoto photo;
  photo.header = {PhotoFormat::kJpeg, 1000, 500, 3, 8};
  EXPECT_EQ(ChooseFocal(photo, 0).focal_px, 1200);
  EXPECT_EQ(ChooseFocal(photo, 900).focal_px, 900);
  EXPECT_EQ(ChooseFocal(photo, std::nan("")).focal_px, 1200);
  EXPECT_EQ(ChooseFocal(photo, -1e300).focal_px, 1200);
  photo.exif.focal_px = 800;
  EXPECT_EQ(ChooseFocal(photo, 900).focal_px, 800);
  EXPECT_TRUE(ChooseFocal(photo, 900).from_exif);
  photo.exif.focal_is_guess = true;
  EXPECT_EQ(ChooseFocal(photo, 900).focal_px, 800);
  EXPECT_FALSE(ChooseFocal(photo, 900).from_exif);
}

TEST(CameraKey, IsSharedByPhotosOfOneBodySizeAndZoom) {
  CheckedPhoto photo;
  photo.header = {PhotoFormat::kJpeg, 1000, 500, 3, 8};
  const std::string key = CameraKey("alice", photo, {1200, false});
  EXPECT_EQ(CameraKey("alice", photo, {1200.2, false}), key);
  EXPECT_NE(CameraKey("bob", photo, {1200, false}), key);
  EXPECT_NE(CameraKey("alice", photo, {2400, false}), key);
  photo.exif.digital_zoom = 2;
  EXPECT_NE(CameraKey("alice", photo, {1200, false}), key);
  photo.exif.digital_zoom = 1;
  EXPECT_EQ(CameraKey("alice", photo, {1200, false}), key);
  photo.header.height_px = 501;
  EXPECT_NE(CameraKey("alice", photo, {1200, false}), key);
}

}  // namespace skein::photo_check_test
