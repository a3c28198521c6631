#include "photo/decoder_wire.h"

#include <gtest/gtest.h>

#include <cmath>

namespace skein::decoder_wire_test {

DecoderAnswer Answer() {
  DecoderAnswer answer;
  answer.status = DataLoss("damaged");
  answer.exif.orientation = 8;
  answer.exif.make = "make";
  answer.exif.model = "model";
  answer.exif.focal_px = 1234.5;
  answer.exif.focal_is_guess = true;
  answer.exif.digital_zoom = 2.5;
  answer.exif.capture_utime_us = -7;
  answer.exif.gps = GpsPosition{-33.5, 151.25, -12.5, 70.5};
  answer.address_space_bytes = uint64_t{1} << 40;
  return answer;
}

Result<DecoderAnswer> Parse(const Bytes& bytes) {
  return ParseDecoderAnswer(bytes.data(), bytes.size());
}

TEST(DecoderWire, RequestsComeAsTheyWent) {
  const DecoderRequest request{
      DecoderRequest::Kind::kDecode, 123, {PhotoFormat::kTiff, 4000, 3000, 0, 0}, 4};
  const Bytes bytes = EncodeDecoderRequest(request);
  const auto parsed = ParseDecoderRequest(bytes.data(), bytes.size());
  ASSERT_TRUE(parsed.ok());
  EXPECT_EQ(parsed->kind, request.kind);
  EXPECT_EQ(parsed->photo_bytes, 123u);
  EXPECT_EQ(parsed->header.format, PhotoFormat::kTiff);
  EXPECT_EQ(parsed->header.width_px, 4000);
  EXPECT_EQ(parsed->header.height_px, 3000);
  EXPECT_EQ(parsed->reduction, 4);
}

TEST(DecoderWire, RefusesAReductionThatThereIsNot) {
  for (const uint8_t reduction : {0, 3, 16}) {
    DecoderRequest request;
    request.reduction = reduction;
    const Bytes bytes = EncodeDecoderRequest(request);
    EXPECT_FALSE(ParseDecoderRequest(bytes.data(), bytes.size()).ok());
  }
}

TEST(DecoderWire, AnswersComeAsTheyWent) {
  const auto parsed = Parse(EncodeDecoderAnswer(Answer()));
  ASSERT_TRUE(parsed.ok());
  EXPECT_EQ(parsed->status.code, StatusCode::kDataLoss);
  EXPECT_EQ(parsed->status.text, "damaged");
  EXPECT_EQ(parsed->exif.orientation, 8);
  EXPECT_EQ(parsed->exif.model, "model");
  EXPECT_EQ(parsed->exif.focal_px, 1234.5);
  EXPECT_TRUE(parsed->exif.focal_is_guess);
  EXPECT_EQ(parsed->exif.digital_zoom, 2.5);
  EXPECT_EQ(parsed->exif.capture_utime_us, -7);
  EXPECT_EQ(parsed->exif.gps->altitude_m, -12.5);
  EXPECT_EQ(parsed->exif.gps->relative_altitude_m, 70.5);
  EXPECT_EQ(parsed->address_space_bytes, uint64_t{1} << 40);
  const auto empty = Parse(EncodeDecoderAnswer(DecoderAnswer()));
  ASSERT_TRUE(empty.ok());
  EXPECT_FALSE(empty->exif.gps || empty->exif.focal_px);
  DecoderAnswer flat = Answer();
  flat.exif.gps = GpsPosition{-33.5, 151.25, {}, {}};
  const auto without = Parse(EncodeDecoderAnswer(flat));
  ASSERT_TRUE(without.ok() && without->exif.gps);
  EXPECT_FALSE(without->exif.gps->altitude_m || without->exif.gps->relative_altitude_m);
}

TEST(DecoderWire, CutsLongTexts) {
  DecoderAnswer answer = Answer();
  answer.status.text = answer.exif.make = answer.exif.model = std::string(100'000, 'x');
  const Bytes bytes = EncodeDecoderAnswer(answer);
  EXPECT_LT(bytes.size(), kMaxDecoderMessage);
  EXPECT_TRUE(Parse(bytes).ok());
}

TEST(DecoderWire, RefusesWhatNoDecoderSays) {
  const Bytes good = EncodeDecoderAnswer(Answer());
  for (size_t size = 0; size < good.size(); ++size) {
    EXPECT_FALSE(Parse(Bytes(good.begin(), good.begin() + static_cast<ptrdiff_t>(size))).ok());
  }
  Bytes longer = good;
  longer.push_back(0);
  EXPECT_FALSE(Parse(longer).ok());
  DecoderAnswer answer = Answer();
  answer.exif.orientation = 9;
  EXPECT_FALSE(Parse(EncodeDecoderAnswer(answer)).ok());
  answer = Answer();
  answer.exif.digital_zoom = 0;
  EXPECT_FALSE(Parse(EncodeDecoderAnswer(answer)).ok());
  answer = Answer();
  answer.exif.focal_px = std::nan("");
  EXPECT_FALSE(Parse(EncodeDecoderAnswer(answer)).ok());
  answer = Answer();
  answer.exif.gps->latitude_deg = 91;
  EXPECT_FALSE(Parse(EncodeDecoderAnswer(answer)).ok());
  answer = Answer();
  answer.exif.gps->relative_altitude_m = std::nan("");
  EXPECT_FALSE(Parse(EncodeDecoderAnswer(answer)).ok());
}

}  // namespace skein::decoder_wire_test
