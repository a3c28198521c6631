#include "export/georeferenced.h"

#include "core/file.h"
#include "geometry/georeference_json.h"

namespace skein {
namespace {

void Move(const Similarity& s, Reconstruction* model) {
  model->Transform(s.scale, s.rotation.toRotationMatrix(), s.translation);
}

}  // namespace

void PlaceOnEarth(const PhotoPositions& positions, std::vector<ExportModel>* models,
                  std::vector<std::string>* refusals) {
  const GeodeticPosition origin = OriginOfPhotos(positions);
  std::vector<ExportModel> placed;
  for (ExportModel& model : *models) {
    const Georeference georeference =
        EstimateGeoreference(origin, PhotosWithPosition(*model.reconstruction, positions));
    if (!georeference.ok) {
      refusals->push_back(model.label + ": " + georeference.reason);
      continue;
    }
    Move(georeference.enu_from_model, model.reconstruction.get());
    model.georeference = GeoreferenceToJson(Summarise(georeference));
    placed.push_back(std::move(model));
  }
  *models = std::move(placed);
}

Status WriteGeoreference(const ExportModel& model, const std::filesystem::path& folder) {
  if (model.georeference.is_null()) return Status::Ok();
  const std::string text = model.georeference.dump(2) + "\n";
  return WriteFileAtomic((folder / "georeference.json").string(), text);
}

}  // namespace skein
