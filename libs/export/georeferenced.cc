#include "export/georeferenced.h"

#include <algorithm>

#include "core/file.h"
#include "geometry/georeference_json.h"

namespace skein {
namespace {

std::vector<GeoPhoto> PhotosWithPosition(const Reconstruction& model,
                                         const std::map<std::string, GeodeticPosition>& positions) {
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

void Move(const Similarity& s, Reconstruction* model) {
  model->Transform(s.scale, s.rotation.toRotationMatrix(), s.translation);
}

}  // namespace

void PlaceOnEarth(const std::map<std::string, GeodeticPosition>& positions,
                  std::vector<ExportModel>* models, std::vector<std::string>* refusals) {
  std::vector<GeodeticPosition> all;
  for (const auto& [name, position] : positions) all.push_back(position);
  const GeodeticPosition origin = EnuOrigin(all);
  std::vector<ExportModel> placed;
  for (ExportModel& model : *models) {
    const Georeference georeference =
        EstimateGeoreference(origin, PhotosWithPosition(*model.reconstruction, positions));
    if (!georeference.ok) {
      refusals->push_back(model.label + ": " + georeference.reason);
      continue;
    }
    Move(georeference.enu_from_model, model.reconstruction.get());
    model.georeference = GeoreferenceToJson(georeference);
    placed.push_back(std::move(model));
  }
  *models = std::move(placed);
}

Status WriteGeoreference(const ExportModel& model, const std::filesystem::path& folder) {
  if (model.georeference.is_null()) return Status::Ok();
  const std::string text = model.georeference.dump(2) + "\n";
  return WriteFileAtomic((folder / "georeference.json").string(), text.data(), text.size());
}

}  // namespace skein
