#include "benchmark/stages/retrieval_photos.h"

#include <algorithm>
#include <filesystem>
#include <opencv2/core.hpp>
#include <optional>

#include "codecs/exif_reader.h"
#include "codecs/image_decoding.h"
#include "core/file.h"
#include "formats/formats.h"
#include "matching/pair_matcher.h"
#include "photo/photo_header.h"

namespace skein::benchmark {
namespace fs = std::filesystem;
namespace {

std::vector<std::string> PhotosIn(const std::string& folder) {
  std::vector<std::string> paths;
  for (const auto& entry : fs::directory_iterator(folder)) {
    std::string extension = entry.path().extension();
    std::transform(extension.begin(), extension.end(), extension.begin(), ::tolower);
    if (extension == ".jpg" || extension == ".jpeg" || extension == ".png") {
      paths.push_back(entry.path());
    }
  }
  std::sort(paths.begin(), paths.end());
  return paths;
}

Status FindFeatures(const std::string& base, const cv::Mat& image, LocalFeatures* features) {
  const std::string keypoints_path = base + ".keypoints";
  const std::string descriptors_path = base + ".descriptors";
  if (fs::exists(keypoints_path) && fs::exists(descriptors_path)) {
    auto keypoints = DecodeKeypoints(*ReadFile(keypoints_path));
    auto descriptors = DecodeDescriptors(*ReadFile(descriptors_path));
    if (!keypoints) return keypoints.status();
    if (!descriptors) return descriptors.status();
    *features = {std::move(*keypoints), std::move(*descriptors)};
    return Status::Ok();
  }
  *features = ExtractSift(image, {});
  const Status written = WriteFileAtomic(keypoints_path, EncodeKeypoints(features->keypoints));
  if (!written.ok()) return written;
  return WriteFileAtomic(descriptors_path, EncodeDescriptors(features->descriptors));
}

Result<StudyPhoto> LoadPhoto(const std::string& path, const std::string& folder) {
  const auto bytes = ReadFile(path);
  if (!bytes) return bytes.status();
  const auto image = DecodePhoto(*bytes);
  if (!image) return image.status().Within(path);
  StudyPhoto photo;
  photo.path = path;
  photo.width_px = image->cols;
  photo.height_px = image->rows;
  const Result<PhotoHeader> header = ReadPhotoHeader(*bytes);
  if (!header) return header.status().Within(path);
  const std::optional<double> focal_px = ReadExif(*bytes, *header).focal_px;
  photo.focal_from_exif = focal_px.has_value();
  photo.focal_px = focal_px.value_or(1.2 * std::max(image->cols, image->rows));
  const std::string base = folder + "/" + fs::path(path).filename().string();
  const Status found = FindFeatures(base, *image, &photo.features);
  if (!found.ok()) return found;
  return photo;
}

std::vector<int32_t> MatchWithEarlier(const std::vector<PhotoFeaturesPtr>& photos, size_t i,
                                      PairMatcher* matcher) {
  std::vector<int32_t> inliers(i, 0);
  for (size_t j = 0; j < i; ++j) {
    const auto geometry = matcher->Match(*photos[i], *photos[j]).geometry;
    if (IsVerified(geometry)) inliers[j] = static_cast<int32_t>(geometry.inlier_matches.size());
  }
  return inliers;
}

// Rows that an earlier run wrote, as 32-bit counts one after another.
std::vector<int32_t> ReadCounts(const std::string& path) {
  if (!fs::exists(path)) return {};
  const auto bytes = ReadFile(path);
  if (!bytes) return {};
  std::vector<int32_t> counts(bytes->size() / sizeof(int32_t));
  ByteReader(*bytes).GetRaw(counts.data(), counts.size() * sizeof(int32_t));
  return counts;
}

}  // namespace

Result<StudySet> LoadStudySet(const std::string& argument, const std::string& cache_folder,
                              const OnProgress& progress) {
  const size_t equals = argument.find('=');
  if (equals == std::string::npos || equals == 0) {
    return InvalidArgument(argument + ": expected NAME=FOLDER");
  }
  StudySet set;
  set.name = argument.substr(0, equals);
  const std::string folder = argument.substr(equals + 1);
  const auto paths = PhotosIn(folder);
  if (paths.empty()) return NotFound("no photos in " + folder);
  const std::string own_folder = cache_folder + "/" + set.name;
  fs::create_directories(own_folder);
  for (const auto& path : paths) {
    auto photo = LoadPhoto(path, own_folder);
    if (!photo) return photo.status();
    set.photos.push_back(std::move(*photo));
    progress(set.photos.size(), paths.size());
  }
  return set;
}

PhotoFeaturesPtr ForMatching(const StudyPhoto& photo, int64_t id, const DescriptorCells* cells) {
  auto features = std::make_shared<PhotoFeatures>();
  features->image_id = id;
  features->camera =
      PriorCamera(photo.width_px, photo.height_px, photo.focal_px, photo.focal_from_exif);
  std::vector<float> scales_px;
  for (const auto& k : photo.features.keypoints) {
    features->points.emplace_back(k.x, k.y);
    scales_px.push_back(k.scale_px);
  }
  features->descriptors = CompactDescriptors(photo.features.descriptors.data);
  features->index = MakeFeatureIndex(features->points, scales_px, features->descriptors, cells);
  return features;
}

Result<InlierCounts> MatchExhaustively(const StudySet& set, const std::string& cache_folder,
                                       const OnProgress& progress) {
  std::vector<PhotoFeaturesPtr> photos;
  for (size_t i = 0; i < set.photos.size(); ++i) {
    photos.push_back(ForMatching(set.photos[i], static_cast<int64_t>(i) + 1, nullptr));
  }
  const std::string path = cache_folder + "/" + set.name + "/inliers.bin";
  std::vector<int32_t> known = ReadCounts(path);
  PairMatcher matcher;
  InlierCounts counts;
  size_t first = 0;
  for (size_t i = 0; i < photos.size(); first += i, ++i) {
    if (known.size() < first + i) {
      known.resize(first);
      const auto row = MatchWithEarlier(photos, i, &matcher);
      known.insert(known.end(), row.begin(), row.end());
      const Status written = WriteFileAtomic(path, known.data(), known.size() * sizeof(int32_t));
      if (!written.ok()) return written;
    }
    counts.emplace_back(known.begin() + first, known.begin() + first + i);
    progress(i + 1, photos.size());
  }
  return counts;
}

}  // namespace skein::benchmark
