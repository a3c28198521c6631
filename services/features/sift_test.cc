#include "features/sift.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <utility>
#include <vector>

#include "core/statistics.h"
#include "features/keypoint_selection.h"
#include "features/usual_contrast.h"

namespace skein::sift_test {

// A bright Gaussian blob with its centre at `centre` (pixel centres at 0.5) on grey.
cv::Mat Blob(cv::Size size, cv::Point2d centre, double sigma) {
  cv::Mat image(size, CV_8UC3);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const double dx = x + 0.5 - centre.x;
      const double dy = y + 0.5 - centre.y;
      const double value = 40 + 180 * std::exp(-(dx * dx + dy * dy) / (2 * sigma * sigma));
      image.at<cv::Vec3b>(y, x) = cv::Vec3b::all(cv::saturate_cast<uint8_t>(value));
    }
  }
  return image;
}

cv::Point2d OffsetOfNearest(const Keypoints& keypoints, cv::Point2d centre) {
  cv::Point2d best(1e9, 1e9);
  for (const auto& k : keypoints) {
    const cv::Point2d offset(k.x - centre.x, k.y - centre.y);
    if (cv::norm(offset) < cv::norm(best)) best = offset;
  }
  return best;
}

cv::Mat Texture(cv::Size size) {
  cv::Mat noise(size, CV_8UC3);
  cv::RNG rng(7);
  rng.fill(noise, cv::RNG::UNIFORM, 0, 256);
  cv::GaussianBlur(noise, noise, {}, 1.5);
  cv::normalize(noise, noise, 0, 255, cv::NORM_MINMAX);
  return noise;
}

// Structure at every scale, as in a photo.
cv::Mat Scene(cv::Size size, uint64_t seed = 11) {
  cv::Mat sum = cv::Mat::zeros(size, CV_32FC3);
  cv::RNG rng(seed);
  for (int cell = 4; cell < size.width; cell *= 2) {
    cv::Mat noise(size.height / cell + 2, size.width / cell + 2, CV_32FC3), layer;
    rng.fill(noise, cv::RNG::NORMAL, 0, 12 * std::sqrt(std::log2(cell)));
    cv::resize(noise, layer, size, 0, 0, cv::INTER_CUBIC);
    sum += layer;
  }
  cv::Mat scene;
  cv::Mat(sum + cv::Scalar::all(120)).convertTo(scene, CV_8UC3);
  return scene;
}

// Keypoints by place, to find those near another.
class KeypointGrid {
 public:
  explicit KeypointGrid(const Keypoints& keypoints) : keypoints_(keypoints) {
    for (size_t i = 0; i < keypoints.size(); ++i) {
      cells_[Cell(keypoints[i].x, keypoints[i].y)].push_back(i);
    }
  }

  // The one that is most like `k`, at most `distance_px` away, of a scale within `ratio`; -1: none.
  int Find(const Keypoint& k, double distance_px, double ratio) const {
    int best = -1;
    double best_angle = CV_PI;
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        const auto cell = cells_.find(Cell(k.x + dx * kCellPx, k.y + dy * kCellPx));
        if (cell == cells_.end()) continue;
        for (const size_t i : cell->second) {
          const Keypoint& other = keypoints_[i];
          const double angle = std::abs(std::remainder(other.angle_rad - k.angle_rad, 2 * CV_PI));
          if (std::hypot(other.x - k.x, other.y - k.y) > distance_px || angle >= best_angle ||
              std::abs(std::log(other.scale_px / k.scale_px)) > std::log(ratio)) {
            continue;
          }
          best = static_cast<int>(i);
          best_angle = angle;
        }
      }
    }
    return best;
  }

 private:
  static constexpr float kCellPx = 8;
  static std::pair<int, int> Cell(float x, float y) {
    return {static_cast<int>(std::floor(x / kCellPx)), static_cast<int>(std::floor(y / kCellPx))};
  }
  const Keypoints& keypoints_;
  std::map<std::pair<int, int>, std::vector<size_t>> cells_;
};

double DescriptorDistance(const uint8_t* a, const uint8_t* b) {
  double sum = 0;
  for (size_t d = 0; d < Descriptors::kDim; ++d) sum += (a[d] - b[d]) * (a[d] - b[d]);
  return std::sqrt(sum);
}

SiftOptions With(const std::string& method) {
  SiftOptions options;
  options.method = method;
  return options;
}
SiftOptions Own(InstructionSet kernel = FastestInstructionSet()) {
  SiftOptions options = With("skein");
  options.kernel = kernel;
  return options;
}
SiftOptions OpenCv() { return With("opencv"); }

std::vector<InstructionSet> SupportedVersions() {
  std::vector<InstructionSet> versions;
  for (const auto version : kInstructionSets) {
    if (IsInstructionSetSupported(version)) versions.push_back(version);
  }
  return versions;
}

// Largest and mean distance of blobs from where they are found, pixels of their octave (of the
// photo, where these are smaller).
struct BlobErrors {
  double most = 0;
  cv::Point2d mean;
};

BlobErrors FindBlobs(SiftExtractor* extractor, double sigma) {
  // A keypoint's sigma is 2^(1/6) to 2^(7/6) times 1.6 of its octave's pixels, a blob's is found as
  // 0.88 of its own. A quadratic through three of these pixels is exact to a part of them.
  const double octave_px =
      std::max(1.0, std::exp2(std::floor(std::log2(0.88 * sigma / 1.6) - 1.0 / 6)));
  BlobErrors errors;
  int count = 0;
  for (const double fx : {0.0, 0.2, 0.45, 0.7}) {
    for (const double fy : {0.1, 0.4, 0.9}) {
      const cv::Point2d centre(150 + fx, 120 + fy);
      const auto features = extractor->Extract(Blob({303, 241}, centre, sigma));
      const cv::Point2d offset = OffsetOfNearest(features.keypoints, centre);
      if (cv::norm(offset) > 1) continue;
      errors.mean += offset;
      errors.most = std::max(errors.most, cv::norm(offset) / octave_px);
      ++count;
    }
  }
  EXPECT_EQ(count, 12) << "sigma " << sigma;
  errors.mean /= octave_px * std::max(1, count);
  return errors;
}

TEST(Sift, FindsBlobsAtTheirCentresAtAnySubpixelPhaseAndScale) {
  for (const auto version : SupportedVersions()) {
    SiftExtractor extractor(Own(version));
    for (const double sigma : {1.5, 2.0, 3.0, 6.0, 12.0}) {
      const BlobErrors errors = FindBlobs(&extractor, sigma);
      const std::string where = InstructionSetName(version) + ", sigma " + std::to_string(sigma);
      EXPECT_LT(errors.most, 0.02) << where;
      EXPECT_LT(cv::norm(errors.mean), 0.012) << where;
    }
  }
}

TEST(Sift, OpenCvsFindsBlobsAtTheirCentresOnAverage) {
  SiftExtractor extractor(OpenCv());
  for (const double sigma : {1.5, 2.0, 3.0, 6.0, 12.0}) {
    const BlobErrors errors = FindBlobs(&extractor, sigma);
    EXPECT_NEAR(errors.mean.x, 0, 0.03) << "sigma " << sigma;
    EXPECT_NEAR(errors.mean.y, 0, 0.03) << "sigma " << sigma;
  }
}

TEST(Sift, EveryVersionFindsTheSameWithinRounding) {
  const cv::Mat photo = Scene({800, 600});
  const auto portable = SiftExtractor(Own(InstructionSet::kPortable)).Extract(photo);
  ASSERT_GT(portable.keypoints.size(), 2000u);
  const KeypointGrid grid(portable.keypoints);
  for (const auto version : SupportedVersions()) {
    const auto features = SiftExtractor(Own(version)).Extract(photo);
    size_t same = 0;
    for (size_t i = 0; i < features.keypoints.size(); ++i) {
      const Keypoint& k = features.keypoints[i];
      const int other = grid.Find(k, 0.01, 1.002);
      if (other < 0) continue;
      same += std::abs(std::remainder(k.angle_rad - portable.keypoints[other].angle_rad,
                                      2 * CV_PI)) < 0.01 &&
              DescriptorDistance(features.descriptors.row(i), portable.descriptors.row(other)) < 10;
    }
    EXPECT_NEAR(features.keypoints.size(), portable.keypoints.size(), 5);
    EXPECT_GT(same, 0.998 * portable.keypoints.size()) << InstructionSetName(version);
  }
}

// Angles, scales and the order of a descriptor's values equal OpenCV's: a codebook and stored
// features fit both extractors.
TEST(Sift, DescribesAsOpenCvDoes) {
  const cv::Mat photo = Scene({800, 600});
  const auto theirs = ExtractSift(photo, OpenCv());
  const auto ours = ExtractSift(photo, Own());
  const KeypointGrid grid(theirs.keypoints);
  std::vector<double> angles, distances;
  for (size_t i = 0; i < ours.keypoints.size(); ++i) {
    const int other = grid.Find(ours.keypoints[i], 0.5, 1.05);
    if (other < 0) continue;
    angles.push_back(std::abs(std::remainder(
        ours.keypoints[i].angle_rad - theirs.keypoints[other].angle_rad, 2 * CV_PI)));
    distances.push_back(DescriptorDistance(ours.descriptors.row(i), theirs.descriptors.row(other)));
  }
  EXPECT_GT(angles.size(), 0.85 * ours.keypoints.size());
  EXPECT_NEAR(ours.keypoints.size(), theirs.keypoints.size(), 0.1 * theirs.keypoints.size());
  EXPECT_LT(UpperMedian(angles), 0.02);
  EXPECT_LT(UpperMedian(distances), 60);  // of vectors of length 512
}

TEST(Sift, IsTheSameOnAnyNumberOfThreads) {
  const cv::Mat photo = Scene({1600, 900});
  SiftExtractor extractor(Own());
  const int before = cv::getNumThreads();
  cv::setNumThreads(4);
  const auto alone = extractor.Extract(photo, 1);
  for (const int threads : {2, 3, 4}) {
    const auto together = extractor.Extract(photo, threads);
    EXPECT_EQ(EncodeKeypoints(together.keypoints), EncodeKeypoints(alone.keypoints));
    EXPECT_EQ(together.descriptors.data, alone.descriptors.data);
  }
  cv::setNumThreads(before);
}

TEST(Sift, KeepsNothingOfEarlierPhotos) {
  SiftExtractor extractor(Own());
  for (const cv::Size size :
       {cv::Size(640, 480), cv::Size(333, 517), cv::Size(97, 40), cv::Size(701, 301)}) {
    const cv::Mat photo = Scene(size);
    const auto again = extractor.Extract(photo);
    const auto fresh = ExtractSift(photo, Own());
    EXPECT_EQ(EncodeKeypoints(again.keypoints), EncodeKeypoints(fresh.keypoints));
    EXPECT_EQ(again.descriptors.data, fresh.descriptors.data);
  }
}

// A change of the photo, and what it does to its pixels.
struct Change {
  std::string name;
  double angle_rad, scale;
  double gain, offset;
};

// to_first: places of the changed photo in the first, pixel centres at 0.5.
cv::Mat Changed(const cv::Mat& photo, const Change& change, cv::Matx23d* to_first) {
  const double cosine = std::cos(change.angle_rad) / change.scale;
  const double sine = std::sin(change.angle_rad) / change.scale;
  const cv::Size size(cvRound(photo.cols * change.scale), cvRound(photo.rows * change.scale));
  const double cx = size.width / 2.0, cy = size.height / 2.0;
  *to_first = cv::Matx23d(cosine, -sine, photo.cols / 2.0 - cosine * cx + sine * cy, sine, cosine,
                          photo.rows / 2.0 - sine * cx - cosine * cy);
  cv::Matx23d centres = *to_first;  // pixel centres at 0
  centres(0, 2) += 0.5 * (cosine - sine) - 0.5;
  centres(1, 2) += 0.5 * (sine + cosine) - 0.5;
  cv::Mat source = photo, changed;
  if (change.scale < 1) cv::GaussianBlur(photo, source, {}, 0.5 / change.scale);
  cv::warpAffine(source, changed, centres, size, cv::INTER_CUBIC | cv::WARP_INVERSE_MAP,
                 cv::BORDER_REFLECT_101);
  changed.convertTo(changed, -1, change.gain, change.offset);
  return changed;
}

// Keypoints of a changed photo that lie inside the first, those of them that the first has, and
// those of these whose descriptor is nearer than 200.
struct Counts {
  double inside = 0, found = 0, matched = 0;

  void operator+=(const Counts& other) {
    inside += other.inside;
    found += other.found;
    matched += other.matched;
  }
  double FoundShare() const { return found / inside; }
  double MatchedShare() const { return matched / found; }
};

Counts Repeat(SiftExtractor* extractor, const cv::Mat& photo, const LocalFeatures& first,
              const Change& change) {
  cv::Matx23d to_first;
  const auto changed = extractor->Extract(Changed(photo, change, &to_first));
  const KeypointGrid grid(first.keypoints);
  Counts counts;
  for (size_t i = 0; i < changed.keypoints.size(); ++i) {
    Keypoint k = changed.keypoints[i];
    const cv::Matx21d at = to_first * cv::Matx31d(k.x, k.y, 1);
    k.x = static_cast<float>(at(0));
    k.y = static_cast<float>(at(1));
    k.scale_px = static_cast<float>(k.scale_px / change.scale);
    k.angle_rad = static_cast<float>(k.angle_rad + change.angle_rad);
    const float margin = 6 * k.scale_px;
    if (k.x < margin || k.y < margin || k.x > photo.cols - margin || k.y > photo.rows - margin ||
        k.scale_px < 1.5 * 1.6) {
      continue;
    }
    ++counts.inside;
    const int other = grid.Find(k, std::max(1.f, 0.3f * k.scale_px), 1.2);
    if (other < 0) continue;
    ++counts.found;
    counts.matched +=
        DescriptorDistance(changed.descriptors.row(i), first.descriptors.row(other)) < 200;
  }
  return counts;
}

TEST(Sift, FindsTheSameInAChangedPhotoAsOftenAsOpenCvs) {
  SiftExtractor own(Own()), opencv(OpenCv());
  const std::vector<Change> changes = {
      {"turned by 30 degrees", CV_PI / 6, 1, 1, 0},
      {"on its side", CV_PI / 2, 1, 1, 0},
      {"half as large", 0, 0.5, 1, 0},
      {"turned and larger", 0.3, 1.4, 1, 0},
      {"twice as large", 0, 2, 1, 0},
      {"darker", 0, 1, 0.8, 10},  // much darker is searched deeper: LooksDeeperWhereContrastIsLow
      {"brighter", 0, 1, 1.2, 15},
  };
  std::vector<Counts> ours(changes.size()), theirs(changes.size());
  for (const uint64_t seed : {1, 2, 3}) {
    const cv::Mat photo = Scene({640, 480}, seed);
    const auto own_first = own.Extract(photo), opencv_first = opencv.Extract(photo);
    for (size_t i = 0; i < changes.size(); ++i) {
      ours[i] += Repeat(&own, photo, own_first, changes[i]);
      theirs[i] += Repeat(&opencv, photo, opencv_first, changes[i]);
    }
  }
  for (size_t i = 0; i < changes.size(); ++i) {
    const Counts &o = ours[i], &t = theirs[i];
    SCOPED_TRACE(changes[i].name);
    std::printf("%-20s of %5.0f found %.3f matched %.3f; OpenCV's of %5.0f %.3f %.3f\n",
                changes[i].name.c_str(), o.inside, o.FoundShare(), o.MatchedShare(), t.inside,
                t.FoundShare(), t.MatchedShare());
    EXPECT_GT(o.inside, 300);
    EXPECT_GT(o.FoundShare(), t.FoundShare() - 0.02);
    EXPECT_GT(o.MatchedShare(), t.MatchedShare() - 0.02);
    EXPECT_GT(o.FoundShare(), 0.6);
    EXPECT_GT(o.MatchedShare(), 0.7);
  }
}

TEST(Sift, PhotosOfAnySizeAreSearched) {
  SiftExtractor extractor(Own());
  const cv::Mat scene = Scene({160, 120});
  for (const cv::Size size : {cv::Size(7, 9), {8, 8}, {9, 30}, {31, 17}, {160, 12}, {11, 120}}) {
    for (const Keypoint& k : extractor.Extract(scene(cv::Rect({0, 0}, size)).clone()).keypoints) {
      EXPECT_TRUE(k.x > 0 && k.y > 0 && k.x < size.width && k.y < size.height);
    }
  }
}

class EitherSift : public testing::TestWithParam<std::string> {};

TEST_P(EitherSift, MapsKeypointsOfAShrunkPhotoToItsFullResolution) {
  const cv::Point2d centre(1203.3, 850.8);
  SiftOptions options = With(GetParam());
  options.max_image_px = 800;
  const auto features = ExtractSift(Blob({2400, 1700}, centre, 18), options);
  const cv::Point2d offset = OffsetOfNearest(features.keypoints, centre);
  EXPECT_NEAR(offset.x, 0, 0.15);
  EXPECT_NEAR(offset.y, 0, 0.15);
}

TEST_P(EitherSift, PhotoWithoutTextureHasNoKeypoints) {
  const auto features =
      ExtractSift(cv::Mat(480, 640, CV_8UC3, cv::Scalar::all(90)), With(GetParam()));
  EXPECT_TRUE(features.keypoints.empty());
  EXPECT_EQ(features.descriptors.rows(), 0u);
}

TEST_P(EitherSift, TinyPhotosHaveNoKeypoints) {
  for (const int side : {1, 2, 5}) {
    EXPECT_TRUE(ExtractSift(cv::Mat(side, side, CV_8UC3, cv::Scalar::all(9)), With(GetParam()))
                    .keypoints.empty());
  }
}

TEST_P(EitherSift, KeepsAtMostTheLimitAndIsDeterministic) {
  const cv::Mat photo = Texture({640, 480});
  SiftOptions options = With(GetParam());
  options.max_features = 500;
  const auto first = ExtractSift(photo, options);
  const auto second = ExtractSift(photo, options);
  EXPECT_EQ(first.keypoints.size(), 500u);
  EXPECT_EQ(first.descriptors.rows(), 500u);
  EXPECT_EQ(first.descriptors.data, second.descriptors.data);
  for (size_t i = 0; i < 500; ++i) {
    EXPECT_EQ(first.keypoints[i].x, second.keypoints[i].x);
    EXPECT_EQ(first.keypoints[i].y, second.keypoints[i].y);
  }
}

TEST_P(EitherSift, TakesTheColourUnderTheKeypoint) {
  cv::Mat photo = Blob({200, 200}, {100, 100}, 5);
  std::vector<cv::Mat> bgr;
  cv::split(photo, bgr);
  bgr[0] /= 4;
  bgr[1] /= 2;
  cv::merge(bgr, photo);
  const auto features = ExtractSift(photo, With(GetParam()));
  ASSERT_FALSE(features.keypoints.empty());
  const Keypoint& k = features.keypoints[0];
  EXPECT_GT(k.r, k.g);
  EXPECT_GT(k.g, k.b);
}

INSTANTIATE_TEST_SUITE_P(Methods, EitherSift, testing::Values("skein", "opencv"),
                         [](const auto& info) { return info.param; });

TEST(RootSift, HasTheSquareRootOfEachShareTimes512) {
  cv::Mat sift = cv::Mat::zeros(3, 128, CV_32F);
  sift.row(0).setTo(3);                // equal shares
  sift.at<float>(1, 5) = 40;           // all in one bin: clamped
  const auto result = RootSift(sift);  // row 2 is all zero
  ASSERT_EQ(result.rows(), 3u);
  EXPECT_EQ(result.row(0)[17], std::lround(512 * std::sqrt(1.0 / 128)));
  EXPECT_EQ(result.row(1)[5], 255);
  EXPECT_EQ(result.row(1)[6], 0);
  EXPECT_EQ(result.row(2)[0], 0);
}

TEST(SelectKeypoints, LeavesWeakRegionsTheirShare) {
  std::vector<cv::KeyPoint> keypoints;
  for (int i = 0; i < 1000; ++i) keypoints.emplace_back(i % 32, i / 32, 2, 0, 1.f + i);
  for (int i = 0; i < 10; ++i) keypoints.emplace_back(600.f, 400.f + i, 2, 0, 0.01f);
  const auto selected = SelectKeypoints(keypoints, {640, 480}, 200);
  ASSERT_EQ(selected.size(), 200u);
  int weak = 0;
  for (const int i : selected) weak += i >= 1000;
  EXPECT_EQ(weak, 10);
  EXPECT_EQ(selected[0], 999);
}

// Things before things, with edges and smooth parts.
cv::Mat Things(cv::Size size) {
  cv::Mat photo(size, CV_8UC3, cv::Scalar::all(128));
  cv::RNG rng(23);
  for (int i = 0; i < 4000; ++i) {
    const double side = 200.0 / (1 + 30 * rng.uniform(0.0, 1.0));
    const cv::RotatedRect thing(
        cv::Point2f(rng.uniform(0.F, 1.F * size.width), rng.uniform(0.F, 1.F * size.height)),
        cv::Size2f(static_cast<float>(side), static_cast<float>(side * rng.uniform(0.3, 1.0))),
        rng.uniform(0.F, 180.F));
    cv::Point2f corners[4];
    thing.points(corners);
    std::vector<cv::Point> outline(corners, corners + 4);
    cv::fillConvexPoly(photo, outline, cv::Scalar::all(rng.uniform(0, 256)), cv::LINE_AA);
  }
  return photo;
}

// As through fog: a share of the contrast around a grey level, stored as a JPEG.
cv::Mat InFog(const cv::Mat& scene, double contrast) {
  cv::Mat hazy;
  scene.convertTo(hazy, CV_8U, contrast, 170 - 128 * contrast);
  std::vector<uint8_t> jpeg;
  cv::imencode(".jpg", hazy, jpeg, {cv::IMWRITE_JPEG_QUALITY, 90});
  return cv::imdecode(jpeg, cv::IMREAD_COLOR);
}

TEST(Sift, LooksDeeperWhereContrastIsLow) {
  const cv::Mat scene = Things({1000, 750});
  const LocalFeatures clear = ExtractSift(scene, {});
  const LocalFeatures hazy = ExtractSift(InFog(scene, 0.08), {});
  ASSERT_GT(clear.keypoints.size(), 2048u);
  EXPECT_GT(hazy.keypoints.size(), 2048u);
  const KeypointGrid grid(hazy.keypoints);
  int num_found = 0;
  for (size_t i = 0; i < 1000; ++i) num_found += grid.Find(clear.keypoints[i], 1.5, 1.4) >= 0;
  EXPECT_GT(num_found, 700);
}

// Photos of noise alone: a covered lens, a white wall.
TEST(Sift, FindsNothingInNoise) {
  for (const double noise : {0.0, 0.5, 1.0, 2.0, 4.0}) {
    for (const int quality : {75, 85, 95}) {
      cv::Mat1f wall(750, 1000, 90.F), deviation(wall.size());
      cv::RNG(17).fill(deviation, cv::RNG::NORMAL, 0, noise);
      for (int x = 0; x < wall.cols; ++x) wall.col(x) += 0.04F * static_cast<float>(x);
      cv::Mat photo;
      cv::Mat(wall + deviation).convertTo(photo, CV_8U);
      std::vector<uint8_t> jpeg;
      cv::imencode(".jpg", photo, jpeg, {cv::IMWRITE_JPEG_QUALITY, quality});
      EXPECT_LT(ExtractSift(cv::imdecode(jpeg, cv::IMREAD_COLOR), {}).keypoints.size(), 300u)
          << noise << " " << quality;
    }
  }
}

TEST(Sift, LooksNoDeeperThanFeaturesAreWanted) {
  const cv::Mat hazy = InFog(Things({1000, 750}), 0.1);
  SiftOptions options;
  options.max_features = 20;
  const size_t few = ExtractSift(hazy, options).keypoints.size();
  EXPECT_EQ(few, 20u);
}

TEST(UsualContrast, FollowsThePhotosContrastAndIsThatOfMostOfIt) {
  cv::Mat grey;
  cv::cvtColor(Scene({800, 600}), grey, cv::COLOR_BGR2GRAY);
  const double usual = UsualContrast(grey);
  cv::Mat half;
  grey.convertTo(half, CV_8U, 0.5, 60);
  EXPECT_NEAR(UsualContrast(half), usual / 2, 0.1 * usual);
  cv::Mat with_sky = grey.clone();
  with_sky.rowRange(0, 200).setTo(250);
  EXPECT_GT(UsualContrast(with_sky), 0.3 * usual);
  EXPECT_NEAR(UsualContrast(cv::Mat1b(100, 100, uint8_t{9})), 0, 1e-6);
}

}  // namespace skein::sift_test
