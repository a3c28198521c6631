#include "mapper/model_assessment.h"

#include "guidance/guided_map.h"
#include "guidance/model_map.h"

namespace skein {
namespace {

std::map<std::string, int64_t> RegisteredByName(const Reconstruction& model) {
  std::map<std::string, int64_t> image_of;
  for (const ImageId id : model.RegImageIds()) image_of[model.Image(id).Name()] = id;
  return image_of;
}

GuidedMap TexturedMap(const Reconstruction& model,
                      const std::map<int64_t, TextureFields>& textures) {
  GuidedMap map = MapOfModel(model, kMaxGuidedPoints);
  for (GuidedPhoto& photo : map.photos) {
    const auto texture = textures.find(photo.image_id);
    if (texture != textures.end()) photo.texture = texture->second;
  }
  return map;
}

}  // namespace

ModelAssessment AssessModel(const Reconstruction& model, const PhotoFacts& photos,
                            double target_gsd_mm) {
  ModelAssessment assessment;
  const Georeference earth = EstimateGeoreference(OriginOfPhotos(photos.positions),
                                                  PhotosWithPosition(model, photos.positions));
  assessment.georeference = Summarise(earth);
  assessment.image_of = RegisteredByName(model);
  if (earth.ok) assessment.metres_per_unit = earth.enu_from_model.scale;
  const double target_gsd =
      earth.ok && target_gsd_mm > 0 ? TargetGsd(target_gsd_mm, assessment.metres_per_unit) : 0;
  const GuidedMap map = TexturedMap(model, photos.textures);
  assessment.place = SummarisePlace(AssessPlace(map, target_gsd), map.photos.size());
  return assessment;
}

}  // namespace skein
