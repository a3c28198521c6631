#include "geometry/model_georeference.h"

#include <algorithm>

namespace skein {

GeodeticPosition OriginOfPhotos(const PhotoPositions& positions) {
  std::vector<GeodeticPosition> all;
  for (const auto& [name, position] : positions) all.push_back(position);
  return EnuOrigin(all);
}

std::vector<GeoPhoto> PhotosWithPosition(const Reconstruction& model,
                                         const PhotoPositions& positions) {
  std::vector<GeoPhoto> photos;
  std::vector<ImageId> ids = model.RegImageIds();
  std::sort(ids.begin(), ids.end());
  for (const ImageId id : ids) {
    const Image& image = model.Image(id);
    const auto position = positions.find(image.Name());
    if (position == positions.end()) continue;
    const Eigen::Vector4d& q = image.Qvec();
    const CameraPose pose{Eigen::Quaterniond(q[0], q[1], q[2], q[3]), image.Tvec()};
    photos.push_back({image.Name(), pose, position->second});
  }
  return photos;
}

}  // namespace skein
