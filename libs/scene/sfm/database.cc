#include "sfm/database.h"

#include <algorithm>

#include "sfm/colmap_api.h"

namespace skein {
namespace {

Image FromColmap(const colmap::Image& image) {
  Image copy;
  copy.SetImageId(image.ImageId());
  copy.SetCameraId(image.CameraId());
  copy.SetName(image.Name());
  return copy;
}

}  // namespace

struct ColmapDatabase::Opened {
  explicit Opened(const std::string& file) : database(file), transaction(&database) {}

  colmap::Database database;
  colmap::DatabaseTransaction transaction;
};

ColmapDatabase::ColmapDatabase(const std::string& file) : opened_(std::make_unique<Opened>(file)) {}

ColmapDatabase::~ColmapDatabase() = default;

bool ColmapDatabase::ExistsCamera(CameraId id) const { return opened_->database.ExistsCamera(id); }

bool ColmapDatabase::ExistsMatches(ImageId id1, ImageId id2) const {
  return opened_->database.ExistsMatches(id1, id2);
}

bool ColmapDatabase::ExistsInlierMatches(ImageId id1, ImageId id2) const {
  return opened_->database.ExistsInlierMatches(id1, id2);
}

size_t ColmapDatabase::NumCameras() const { return opened_->database.NumCameras(); }

CameraId ColmapDatabase::WriteCamera(const Camera& camera) {
  return opened_->database.WriteCamera(colmap_api::ToColmap(camera),
                                       camera.CameraId() != kInvalidCameraId);
}

void ColmapDatabase::WriteImage(ImageId id, CameraId camera_id, const std::string& name) {
  colmap::Image image;
  image.SetImageId(id);
  image.SetCameraId(camera_id);
  image.SetName(name);
  opened_->database.WriteImage(image, true);
}

void ColmapDatabase::WriteKeypoints(ImageId id, const Keypoints& keypoints) {
  colmap::FeatureKeypoints rows;
  for (const Keypoint& k : keypoints) rows.emplace_back(k.x, k.y, k.scale_px, k.angle_rad);
  opened_->database.WriteKeypoints(id, rows);
}

void ColmapDatabase::WriteDescriptors(ImageId id, const Descriptors& descriptors) {
  colmap::FeatureDescriptors matrix(descriptors.rows(), Descriptors::kDim);
  std::copy(descriptors.data.begin(), descriptors.data.end(), matrix.data());
  opened_->database.WriteDescriptors(id, matrix);
}

void ColmapDatabase::WriteMatches(ImageId id1, ImageId id2, const FeatureMatches& matches) {
  opened_->database.WriteMatches(id1, id2, colmap_api::ToColmap(matches));
}

void ColmapDatabase::WriteTwoViewGeometry(ImageId id1, ImageId id2,
                                          const TwoViewGeometry& geometry) {
  opened_->database.WriteTwoViewGeometry(id1, id2, colmap_api::ToColmap(geometry));
}

Camera ColmapDatabase::ReadCamera(CameraId id) const {
  return colmap_api::FromColmap(opened_->database.ReadCamera(id));
}

std::vector<Image> ColmapDatabase::ReadAllImages() const {
  std::vector<Image> images;
  for (const colmap::Image& image : opened_->database.ReadAllImages()) {
    images.push_back(FromColmap(image));
  }
  return images;
}

Keypoints ColmapDatabase::ReadKeypoints(ImageId id) const {
  Keypoints keypoints;
  for (const colmap::FeatureKeypoint& k : opened_->database.ReadKeypoints(id)) {
    keypoints.push_back({k.x, k.y, k.ComputeScale(), k.ComputeOrientation(), 0, 0, 0});
  }
  return keypoints;
}

Descriptors ColmapDatabase::ReadDescriptors(ImageId id) const {
  const colmap::FeatureDescriptors matrix = opened_->database.ReadDescriptors(id);
  Descriptors descriptors;
  descriptors.data.assign(matrix.data(), matrix.data() + matrix.size());
  return descriptors;
}

TwoViewGeometry ColmapDatabase::ReadTwoViewGeometry(ImageId id1, ImageId id2) const {
  return colmap_api::FromColmap(opened_->database.ReadTwoViewGeometry(id1, id2));
}

}  // namespace skein
