#include "formats/formats.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

#include "formats/texture_fields.h"

namespace skein::formats_test {

TEST(TextureFields, EachFieldHasItsBit) {
  TextureFields fields;
  fields.Set(0, 0);
  fields.Set(9, 1);
  fields.Set(TextureFields::kColumns - 1, TextureFields::kRows - 1);
  EXPECT_EQ(fields.bits[0], 1);
  EXPECT_EQ(fields.bits[9], 2);
  EXPECT_EQ(fields.bits.back(), 128);
  EXPECT_TRUE(fields.Has(9, 1));
  EXPECT_FALSE(fields.Has(1, 9));
}

Keypoints SomeKeypoints() { return {{1.5f, 2.5f, 3, -1, 1, 2, 3}, {0.5f, 0.5f, 1, 3, 255, 0, 9}}; }

TwoViewPairs SomePairs() {
  TwoViewPair pair;
  pair.other_id = 7;
  pair.geometry = 2;
  pair.E[8] = 0.25;
  pair.F[1] = -3;
  pair.H[4] = 1;
  pair.qvec = {0.5, 0.5, 0.5, 0.5};
  pair.tvec = {0, 0, 1};
  pair.tri_angle_rad = 0.1f;
  pair.forward_motion = 0.9f;
  pair.inliers = {{0, 4}, {8000, 3}};
  return {pair, TwoViewPair{}};
}

SharedImages SomeSharedImages() {
  SharedImage image;
  image.image_id = 5;
  image.camera_model_id = 2;
  image.params = {1000, 320, 240, 0.01};
  image.width = 640;
  image.height = 480;
  image.tvec = {1, 2, 3};
  image.points = {{4, {1, 2, 3}, 10, 20}};
  return {image, SharedImage{}};
}

TEST(Formats, KeypointsSurviveTheRoundTrip) {
  const Bytes bytes = EncodeKeypoints(SomeKeypoints());
  const auto decoded = DecodeKeypoints(bytes);
  ASSERT_TRUE(decoded.ok()) << decoded.error();
  ASSERT_EQ(decoded->size(), 2u);
  EXPECT_EQ((*decoded)[0].x, 1.5f);
  EXPECT_EQ((*decoded)[0].angle_rad, -1.f);
  EXPECT_EQ((*decoded)[1].b, 9);
  EXPECT_EQ(EncodeKeypoints(*decoded), bytes);
}

TEST(Formats, DescriptorsSurviveTheRoundTrip) {
  Descriptors descriptors;
  for (int i = 0; i < 256; ++i) descriptors.data.push_back(static_cast<uint8_t>(i));
  const auto decoded = DecodeDescriptors(EncodeDescriptors(descriptors));
  ASSERT_TRUE(decoded.ok()) << decoded.error();
  EXPECT_EQ(decoded->rows(), 2u);
  EXPECT_EQ(decoded->row(1)[0], 128);
  EXPECT_EQ(decoded->data, descriptors.data);
}

TEST(Formats, DescriptorsOfAnotherWidthAreABrokenContract) {
  Descriptors descriptors;
  descriptors.data.resize(127);
  EXPECT_THROW(EncodeDescriptors(descriptors), std::invalid_argument);
}

TEST(Formats, GlobalDescriptorsHaveABound) {
  GlobalDescriptor large{"vlad-1", std::vector<float>(kMaxGlobalDescriptorValues)};
  EXPECT_TRUE(DecodeGlobalDescriptor(EncodeGlobalDescriptor(large)).ok());
  large.values.push_back(0);
  EXPECT_FALSE(DecodeGlobalDescriptor(EncodeGlobalDescriptor(large)).ok());
}

TEST(Formats, GlobalDescriptorSurvivesTheRoundTrip) {
  const auto decoded = DecodeGlobalDescriptor(EncodeGlobalDescriptor({"vlad-1", {0.6f, 0.8f}}));
  ASSERT_TRUE(decoded.ok()) << decoded.error();
  EXPECT_EQ(decoded->model, "vlad-1");
  EXPECT_EQ(decoded->values, (std::vector<float>{0.6f, 0.8f}));
}

TEST(Formats, TwoViewPairsSurviveTheRoundTrip) {
  const Bytes bytes = EncodeTwoViewPairs(SomePairs());
  const auto decoded = DecodeTwoViewPairs(bytes);
  ASSERT_TRUE(decoded.ok()) << decoded.error();
  EXPECT_EQ((*decoded)[0].other_id, 7);
  EXPECT_EQ((*decoded)[0].F[1], -3);
  EXPECT_EQ((*decoded)[0].inliers, SomePairs()[0].inliers);
  EXPECT_EQ(EncodeTwoViewPairs(*decoded), bytes);
}

TEST(Formats, ModelArchiveSurvivesTheRoundTrip) {
  const ModelArchive archive = {{"cameras.bin", {1, 2}}, {"side.bin", {}}};
  const auto decoded = DecodeModelArchive(EncodeModelArchive(archive));
  ASSERT_TRUE(decoded.ok()) << decoded.error();
  EXPECT_EQ(*decoded, archive);
}

TEST(Formats, ModelArchiveHasOneOrderOfItsFiles) {
  Bytes bytes = EncodeModelArchive({{"a", {1}}, {"b", {1}}});
  ASSERT_TRUE(DecodeModelArchive(bytes).ok());
  const auto at = std::find(bytes.begin(), bytes.end(), 'a');
  for (const char first : {'b', 'c'}) {
    *at = first;
    EXPECT_FALSE(DecodeModelArchive(bytes).ok()) << first;
  }
}

TEST(Formats, SharedImagesSurviveTheRoundTrip) {
  const Bytes bytes = EncodeSharedImages(SomeSharedImages());
  const auto decoded = DecodeSharedImages(bytes);
  ASSERT_TRUE(decoded.ok()) << decoded.error();
  EXPECT_EQ((*decoded)[0].points[0].xyz[2], 3);
  EXPECT_EQ((*decoded)[0].params.size(), 4u);
  EXPECT_EQ(EncodeSharedImages(*decoded), bytes);
}

struct Format {
  const char* name;
  Bytes bytes;
  std::function<bool(const Bytes&)> decodes;
};

std::vector<Format> AllFormats() {
  Descriptors descriptors;
  descriptors.data.resize(128, 3);
  return {
      {"keypoints", EncodeKeypoints(SomeKeypoints()),
       [](const Bytes& b) { return DecodeKeypoints(b).ok(); }},
      {"descriptors", EncodeDescriptors(descriptors),
       [](const Bytes& b) { return DecodeDescriptors(b).ok(); }},
      {"global", EncodeGlobalDescriptor({"vlad", {1, 0}}),
       [](const Bytes& b) { return DecodeGlobalDescriptor(b).ok(); }},
      {"pairs", EncodeTwoViewPairs(SomePairs()),
       [](const Bytes& b) { return DecodeTwoViewPairs(b).ok(); }},
      {"archive", EncodeModelArchive({{"a", {1, 2, 3}}}),
       [](const Bytes& b) { return DecodeModelArchive(b).ok(); }},
      {"shared", EncodeSharedImages(SomeSharedImages()),
       [](const Bytes& b) { return DecodeSharedImages(b).ok(); }},
  };
}

TEST(Formats, RefuseEveryTruncationAndTrailingBytes) {
  for (const Format& format : AllFormats()) {
    for (size_t size = 0; size < format.bytes.size(); ++size) {
      const Bytes cut(format.bytes.begin(), format.bytes.begin() + size);
      EXPECT_FALSE(format.decodes(cut)) << format.name << " cut to " << size;
    }
    Bytes longer = format.bytes;
    longer.push_back(0);
    EXPECT_FALSE(format.decodes(longer)) << format.name;
  }
}

TEST(Formats, RefuseAnotherIdentifierVersionOrHugeCount) {
  for (const Format& format : AllFormats()) {
    for (const size_t at : {0u, 4u, 11u}) {
      Bytes changed = format.bytes;
      changed[at] ^= 0x7f;
      EXPECT_FALSE(format.decodes(changed)) << format.name << " byte " << at;
    }
  }
}

TEST(Formats, EmptyValuesAreValid) {
  EXPECT_TRUE(DecodeKeypoints(EncodeKeypoints({}))->empty());
  EXPECT_EQ(DecodeDescriptors(EncodeDescriptors({}))->rows(), 0u);
  EXPECT_TRUE(DecodeTwoViewPairs(EncodeTwoViewPairs({}))->empty());
  EXPECT_TRUE(DecodeModelArchive(EncodeModelArchive({}))->empty());
  EXPECT_TRUE(DecodeSharedImages(EncodeSharedImages({}))->empty());
}

}  // namespace skein::formats_test
