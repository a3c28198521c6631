// How complete the place of a model is, and where it lies on the earth.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "formats/texture_fields.h"
#include "geometry/georeference_summary.h"
#include "geometry/model_georeference.h"
#include "guidance/place_summary.h"
#include "sfm/reconstruction.h"

namespace skein {

// Data of photos from the ledger.
struct PhotoFacts {
  PhotoPositions positions;                   // of all photos of the session
  std::map<int64_t, TextureFields> textures;  // by image id; others are taken for textured
};

struct ModelAssessment {
  GeoreferenceSummary georeference;         // in ENU at the origin of all positions
  std::map<std::string, int64_t> image_of;  // of the registered photos, by name
  PlaceSummary place;
  double metres_per_unit = 0;  // 0: not known
};

// target_gsd_mm: millimetres of the surface that a pixel may cover, where the scale is known. 0, or
// without a scale: twice that of the median point. At most kMaxGuidedPoints points are looked at:
// a second of CPU for 150,000 points of 600 photos.
ModelAssessment AssessModel(const Reconstruction& model, const PhotoFacts& photos,
                            double target_gsd_mm);

}  // namespace skein
