#pragma once

#include <memory>
#include <string>
#include <vector>

#include "formats/formats.h"
#include "sfm/camera.h"
#include "sfm/feature_match.h"
#include "sfm/image.h"
#include "sfm/two_view_geometry.h"

namespace skein {

// COLMAP's database.db (colmap.github.io/database.html): cameras, photos, features, matches. All
// changes are one transaction, which ends with the object. COLMAP ends the process if the file
// cannot be opened or written, and on ids that are not there.
class ColmapDatabase {
 public:
  // Makes the file and its tables where they are missing.
  explicit ColmapDatabase(const std::string& file);
  ~ColmapDatabase();

  bool ExistsCamera(CameraId id) const;
  bool ExistsMatches(ImageId id1, ImageId id2) const;
  bool ExistsInlierMatches(ImageId id1, ImageId id2) const;
  size_t NumCameras() const;

  // A camera without an id gets the next. Returns the id.
  CameraId WriteCamera(const Camera& camera);
  void WriteImage(ImageId id, CameraId camera_id, const std::string& name);
  void WriteKeypoints(ImageId id, const Keypoints& keypoints);
  void WriteDescriptors(ImageId id, const Descriptors& descriptors);
  void WriteMatches(ImageId id1, ImageId id2, const FeatureMatches& matches);
  void WriteTwoViewGeometry(ImageId id1, ImageId id2, const TwoViewGeometry& geometry);

  Camera ReadCamera(CameraId id) const;
  std::vector<Image> ReadAllImages() const;   // ids, cameras and names
  Keypoints ReadKeypoints(ImageId id) const;  // without colours
  Descriptors ReadDescriptors(ImageId id) const;
  TwoViewGeometry ReadTwoViewGeometry(ImageId id1, ImageId id2) const;

 private:
  struct Opened;
  std::unique_ptr<Opened> opened_;
};

}  // namespace skein
