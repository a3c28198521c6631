// A camera that moves over a painted wall.
#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <random>

#include "clients/video/frame_picker.h"
#include "clients/video/video_photos.h"
#include "clients/video/video_source.h"
#include "codecs/exif_reader.h"
#include "core/file.h"
#include "testing/test_folder.h"

namespace skein::video_test {

constexpr int kWidth = 320, kHeight = 240;

cv::Mat3b PaintWall() {
  cv::Mat3b wall(2 * kHeight, 10 * kWidth, cv::Vec3b(128, 128, 128));
  std::mt19937 random(7);
  const auto below = [&](int end) { return static_cast<int>(random() % end); };
  for (int i = 0; i < 4000; ++i) {
    const cv::Point at(below(wall.cols), below(wall.rows));
    cv::circle(wall, at, 2 + below(12), cv::Scalar(below(256), below(256), below(256)), cv::FILLED);
  }
  return wall;
}

class VideoTest : public testing::Test {
 protected:
  VideoFrame At(double x_px, double blur_px = 0) {
    VideoFrame frame;
    frame.image = wall_(cv::Rect(static_cast<int>(x_px), 40, kWidth, kHeight)).clone();
    if (blur_px > 0) cv::GaussianBlur(frame.image, frame.image, {}, blur_px);
    frame.index = next_++;
    return frame;
  }
  // Indices of the photos.
  std::vector<int64_t> Pick(const std::vector<VideoFrame>& frames) {
    FramePicker picker(options_);
    std::vector<int64_t> photos;
    for (const VideoFrame& frame : frames) {
      if (const auto photo = picker.Add(frame)) photos.push_back(photo->index);
    }
    if (const auto photo = picker.Finish()) photos.push_back(photo->index);
    return photos;
  }

  const cv::Mat3b wall_ = PaintWall();
  FramePickerOptions options_;
  int64_t next_ = 0;
};

TEST_F(VideoTest, TakesPhotosByMotionNotByTime) {
  std::vector<VideoFrame> slow, fast;
  for (int i = 0; i < 200; ++i) slow.push_back(At(2 * i));
  next_ = 0;
  for (int i = 0; i < 50; ++i) fast.push_back(At(8 * i));
  const size_t num_slow = Pick(slow).size(), num_fast = Pick(fast).size();
  // 400 px, a photo each 16 to 48 px.
  for (const size_t num : {num_slow, num_fast}) {
    EXPECT_GE(num, 8u);
    EXPECT_LE(num, 27u);
  }
}

TEST_F(VideoTest, ACameraThatStandsStillGivesOnePhoto) {
  std::vector<VideoFrame> frames;
  for (int i = 0; i < 100; ++i) frames.push_back(At(100));
  EXPECT_EQ(Pick(frames).size(), 1u);
}

TEST_F(VideoTest, TakesTheSharpestOfTheFramesInBetween) {
  std::vector<VideoFrame> frames;
  for (int i = 0; i < 120; ++i) frames.push_back(At(4 * i, i % 4 == 0 ? 0 : 1));
  for (const int64_t index : Pick(frames)) EXPECT_EQ(index % 4, 0) << index;
}

TEST_F(VideoTest, TakesNoBlurredFrameOfAFastTurn) {
  std::vector<VideoFrame> frames;
  for (int i = 0; i < 20; ++i) frames.push_back(At(0));
  for (int i = 0; i < 10; ++i) frames.push_back(At(100 * i, 8));  // a fast turn
  for (int i = 0; i < 20; ++i) frames.push_back(At(1000));
  const std::vector<int64_t> photos = Pick(frames);
  ASSERT_EQ(photos.size(), 2u);
  EXPECT_LT(photos[0], 20);
  EXPECT_GE(photos[1], 30);
}

TEST_F(VideoTest, AViewWithoutCornersGivesNoPhoto) {
  std::vector<VideoFrame> frames;
  const auto add_plain = [&](int num) {
    for (int i = 0; i < num; ++i) {
      frames.push_back(At(0));
      frames.back().image = cv::Vec3b(90, 100, 110);
    }
  };
  add_plain(40);
  frames.push_back(At(0));
  add_plain(40);
  frames.push_back(At(900));
  EXPECT_EQ(Pick(frames), (std::vector<int64_t>{40, 81}));
}

TEST_F(VideoTest, TheFileIsReadToItsEndAndItsPhotosAreKept) {
  TestFolder folder;
  const std::string file = (folder / "walk.avi").string();
  cv::VideoWriter writer(file, cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), 25, {kWidth, kHeight});
  ASSERT_TRUE(writer.isOpened());
  for (int i = 0; i < 60; ++i) writer.write(At(5 * i).image);
  writer.release();
  std::filesystem::create_directory(folder / "photos");

  std::vector<std::string> first;
  for (const int64_t expected_new : {1, 0}) {
    PollLoop loop;
    std::vector<std::string> names;
    std::set<std::string> known(first.begin(), first.end());
    VideoPhotos video(loop, file, folder / "photos", FramePickerOptions(), known,
                      [&](const std::vector<PhotoFile>& photos) {
                        for (const PhotoFile& photo : photos) names.push_back(photo.name);
                      });
    ASSERT_TRUE(loop.RunUntil([&] { return video.done(); }, 60));
    EXPECT_EQ(!names.empty(), expected_new > 0);
    EXPECT_NE(video.Summary().find("of 60 frames"), std::string::npos) << video.Summary();
    if (first.empty()) first = names;
  }
  ASSERT_GE(first.size(), 6u);
  EXPECT_EQ(ListPhotos(folder / "photos", PhotoOrder()).size(), first.size());
  int64_t last_utime_us = 0;
  for (const std::string& name : first) {
    EXPECT_EQ(name.rfind("walk-", 0), 0u);
    const Result<Bytes> jpeg = ReadFile((folder / "photos" / name).string());
    ASSERT_TRUE(jpeg.ok());
    const Result<PhotoHeader> header = ReadPhotoHeader(*jpeg);
    ASSERT_TRUE(header.ok());
    EXPECT_EQ(header->width_px, kWidth);
    const int64_t utime_us = ReadExif(*jpeg, *header).capture_utime_us;
    EXPECT_GT(utime_us, last_utime_us);
    last_utime_us = utime_us;
  }
}

TEST_F(VideoTest, ASourceThatIsAbsentIsToldWithWhatToCheck) {
  EXPECT_FALSE(VideoSource::Open("/nowhere/walk.mp4").ok());
  const Result<VideoSource> camera = VideoSource::Open("/dev/video9999");
  ASSERT_FALSE(camera.ok());
  EXPECT_NE(camera.error().find("camera"), std::string::npos);
}

TEST(FramePickerOptions, AreChecked) {
  FramePickerOptions options;
  EXPECT_TRUE(options.Check().ok());
  options.min_motion = options.max_motion;
  EXPECT_FALSE(options.Check().ok());
}

}  // namespace skein::video_test
