#include "features/describe_photo.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "testing/test_photos.h"

namespace skein::describe_photo_test {

// Blobs from 3 to 400 pixels, the larger the stronger, as in nature.
cv::Mat Texture(cv::Size size) {
  cv::Mat1f sum = cv::Mat1f::zeros(size);
  for (int blob_px = 3; blob_px <= 400; blob_px *= 2) {
    cv::Mat1f layer;
    Noise(size.width / blob_px, size.height / blob_px, CV_8UC1, blob_px).convertTo(layer, CV_32F);
    cv::resize(layer, layer, size, 0, 0, cv::INTER_CUBIC);
    sum += std::sqrt(blob_px) * layer;
  }
  cv::Mat grey, photo;
  cv::normalize(sum, sum, 0, 255, cv::NORM_MINMAX);
  sum.convertTo(grey, CV_8U);
  cv::cvtColor(grey, photo, cv::COLOR_GRAY2BGR);
  return photo;
}

int DistanceSq(const uint8_t* a, const uint8_t* b) {
  int sum = 0;
  for (size_t d = 0; d < Descriptors::kDim; ++d) sum += (a[d] - b[d]) * (a[d] - b[d]);
  return sum;
}

class NoModel : public GlobalDescriptorModel {
 public:
  const std::string& id() const override { return id_; }
  int dim() const override { return 1; }
  std::vector<float> Describe(const DescribedPhoto&) override { return {1}; }

 private:
  const std::string id_ = "none";
};

struct Agreement {
  double found = 0;       // share of the keypoints that the other has within 1 px, alike
  double dx = 0, dy = 0;  // mean offset of these, px
};

Agreement Compare(const LocalFeatures& features, const LocalFeatures& other) {
  Agreement result;
  for (size_t i = 0; i < features.keypoints.size(); ++i) {
    const Keypoint& k = features.keypoints[i];
    for (size_t j = 0; j < other.keypoints.size(); ++j) {
      const double dx = k.x - other.keypoints[j].x, dy = k.y - other.keypoints[j].y;
      if (std::hypot(dx, dy) > 1) continue;
      if (DistanceSq(features.descriptors.row(i), other.descriptors.row(j)) > 200 * 200) continue;
      result.found += 1;
      result.dx += dx;
      result.dy += dy;
      break;
    }
  }
  result.dx /= result.found;
  result.dy /= result.found;
  result.found /= static_cast<double>(features.keypoints.size());
  return result;
}

// At half of the resolution, which suffices for the 1,600 pixels that are searched.
TEST(DescribePhoto, DecodesALargeJpegInPartAndFindsTheSame) {
  const auto decoder = *PhotoDecoder::Start();
  SiftExtractor sift{SiftOptions()};
  NoModel model;
  for (const cv::Size size : {cv::Size(3200, 2400), {4001, 2003}}) {
    const Bytes photo = Encode(Texture(size), ".jpg");
    const auto described =
        DescribePhoto(decoder.get(), photo, size.width, size.height, 1, &sift, 1, &model);
    ASSERT_TRUE(described.ok()) << described.error();
    const auto whole = decoder->Decode(photo);
    ASSERT_TRUE(whole.ok()) << whole.error();
    ASSERT_EQ(whole->image.size(), size);
    const LocalFeatures of_whole = sift.Extract(whole->image);
    const Agreement agreement = Compare(described->local, of_whole);
    std::printf("%zu and %zu keypoints, %.3f found, offset %.3f %.3f px\n",
                described->local.keypoints.size(), of_whole.keypoints.size(), agreement.found,
                agreement.dx, agreement.dy);
    EXPECT_GT(described->local.keypoints.size(), 1000u);
    EXPECT_GT(agreement.found, 0.8);
    EXPECT_NEAR(agreement.dx, 0, 0.05);
    EXPECT_NEAR(agreement.dy, 0, 0.05);
    EXPECT_NEAR(described->quality.coverage, 1, 0.05);
  }
}

// A photo that is stored as a mirror image has the features of the scene, where it is unmirrored.
TEST(DescribePhoto, UnmirrorsWhatIsStoredMirrored) {
  const auto decoder = *PhotoDecoder::Start();
  SiftExtractor sift{SiftOptions()};
  NoModel model;
  const cv::Mat scene = Texture({640, 480});
  const LocalFeatures of_scene = sift.Extract(scene);
  for (const int orientation : {2, 4, 5, 7}) {
    cv::Mat stored;
    cv::flip(scene, stored, 1);
    ExifBuilder exif;
    exif.Short(0, 0x0112, static_cast<uint16_t>(orientation));
    const Bytes photo = exif.Into(Encode(stored, ".jpg"));
    const auto described =
        DescribePhoto(decoder.get(), photo, 640, 480, orientation, &sift, 1, &model);
    ASSERT_TRUE(described.ok()) << described.error();
    EXPECT_GT(Compare(described->local, of_scene).found, 0.6) << orientation;
  }
}

TEST(DescribePhoto, RefusesAPhotoOfAnotherSizeThanIngestRead) {
  const auto decoder = *PhotoDecoder::Start();
  SiftExtractor sift{SiftOptions()};
  NoModel model;
  EXPECT_EQ(DescribePhoto(decoder.get(), SmallJpeg(), 97, 80, 1, &sift, 1, &model).error(),
            "decodes to 96 x 80 pixels, its header says 97 x 80");
}

}  // namespace skein::describe_photo_test
