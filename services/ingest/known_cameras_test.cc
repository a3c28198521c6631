#include "ingest/known_cameras.h"

#include <gtest/gtest.h>

namespace skein::known_cameras_test {

constexpr char kEntry[] =
    "[[cameras]]\nagent = \"drone*\"\nbody = \"DJI FC?30\"\nsize = \"4000x3000\"\n"
    "camera_model = \"SIMPLE_RADIAL\"\nparams = [2800, 2000.5, 1500, -0.01]\n";

Status Read(const std::string& text, std::vector<KnownCamera>* cameras) {
  return ReadKnownCameras(*ParseConfigFile(text, "my.toml"), cameras);
}

// The error of the entry with one of its lines replaced.
std::string ErrorOf(const std::string& from, const std::string& to) {
  std::string text = kEntry;
  text.replace(text.find(from), from.size(), to);
  std::vector<KnownCamera> cameras;
  return Read(text, &cameras).error();
}

CheckedPhoto Photo(int width_px, int height_px, const std::string& model) {
  CheckedPhoto photo;
  photo.header.width_px = width_px;
  photo.header.height_px = height_px;
  photo.exif.make = "DJI";
  photo.exif.model = model;
  return photo;
}

TEST(KnownCameras, FitByAgentBodyAndSize) {
  std::vector<KnownCamera> cameras;
  const Status status = Read(kEntry, &cameras);
  ASSERT_TRUE(status.ok()) << status.error();
  const CheckedPhoto photo = Photo(4000, 3000, "FC330");
  const KnownCamera* camera = FindKnownCamera(cameras, "drone-1", photo);
  ASSERT_NE(camera, nullptr);
  EXPECT_EQ(camera->params, (std::vector<double>{2800, 2000.5, 1500, -0.01}));
  EXPECT_EQ(camera->FocalPx(), 2800);
  EXPECT_FALSE(camera->refine);
  EXPECT_EQ(FindKnownCamera(cameras, "phone", photo), nullptr);
  EXPECT_EQ(FindKnownCamera(cameras, "drone-1", Photo(3000, 4000, "FC330")), nullptr);
  EXPECT_EQ(FindKnownCamera(cameras, "drone-1", Photo(4000, 3000, "FC6310")), nullptr);
}

TEST(KnownCameras, FirstThatFitsCounts) {
  std::vector<KnownCamera> cameras;
  const std::string any =
      "[[cameras]]\nsize = \"4000x3000\"\ncamera_model = \"PINHOLE\"\n"
      "params = [2900, 2910, 2000, 1500]\nrefine = true\n";
  ASSERT_TRUE(Read(kEntry + any, &cameras).ok());
  EXPECT_EQ(FindKnownCamera(cameras, "drone", Photo(4000, 3000, "FC330")), &cameras[0]);
  const KnownCamera* other = FindKnownCamera(cameras, "phone", Photo(4000, 3000, ""));
  ASSERT_EQ(other, &cameras[1]);
  EXPECT_TRUE(other->refine);
  EXPECT_EQ(other->FocalPx(), 2905);
}

TEST(KnownCameras, BadEntriesSayWhatToMend) {
  EXPECT_EQ(
      ErrorOf("size = \"4000x3000\"", "size = \"large\""),
      "my.toml: [[cameras]], entry 1: size is \"large\": give WIDTHxHEIGHT, as \"4000x3000\"");
  EXPECT_NE(ErrorOf("size = \"4000x3000\"\n", "").find("size is needed"), std::string::npos);
  EXPECT_NE(ErrorOf("SIMPLE_RADIAL", "RADIALL").find("camera_model is \"RADIALL\""),
            std::string::npos);
  EXPECT_NE(ErrorOf("2800, ", "").find("params has 3 values; SIMPLE_RADIAL takes f, cx, cy, k"),
            std::string::npos);
  EXPECT_NE(ErrorOf("2800", "wide").find("params has \"wide\": give numbers"), std::string::npos);
  EXPECT_NE(ErrorOf("2800", "2.8").find("cannot be of a photo of that size"), std::string::npos);
  EXPECT_NE(ErrorOf("2000.5", "9000").find("cannot be of a photo of that size"), std::string::npos);
  EXPECT_NE(ErrorOf("agent", "agnet").find("agnet is no key"), std::string::npos);
  EXPECT_NE(ErrorOf("params", "refine = maybe\nparams").find("refine is \"maybe\""),
            std::string::npos);
}

TEST(KnownCameras, ReadBackAsTheyAreWritten) {
  std::vector<KnownCamera> cameras, again;
  ASSERT_TRUE(Read(kEntry, &cameras).ok());
  const std::string text = KnownCamerasText(cameras, true);
  ASSERT_TRUE(Read(text, &again).ok());
  EXPECT_EQ(KnownCamerasText(again, true), text);
  EXPECT_EQ(KnownCamerasText({}, false), "");
}

}  // namespace skein::known_cameras_test
