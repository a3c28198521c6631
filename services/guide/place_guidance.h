// All that is said of one submap: how complete the place is, and what each agent can photograph
// next.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "core/result.h"
#include "formats/texture_fields.h"
#include "geometry/georeference.h"
#include "guidance/live_place.h"
#include "guidance/place_summary.h"
#include "guidance/stations.h"
#include "guide/guide_options.h"
#include "guide/shape_map.h"
#include "shapes/shape_store.h"

namespace skein {

// Data of a photo from the ledger.
struct GuidePhoto {
  std::string agent, name;
  bool has_position = false;
  GeodeticPosition position;
  std::optional<TextureFields> texture = std::nullopt;  // nullopt: not known
};

struct PlaceInput {
  ShapePtr shape;                                         // with tracks
  std::map<int64_t, GuidePhoto> photos;                   // of the shape, by image_id
  std::set<std::string> agents;                           // that are told what to photograph
  std::map<std::string, std::vector<VainPhoto>> in_vain;  // by agent
};

struct AdvisedStation {
  Station station;
  int64_t nearest_image_id = 0;
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();  // in the camera frame of that photo
  std::string sentence;
};

struct AgentAdvice {
  std::string agent;
  int64_t last_image_id = 0;  // its newest photo in the shape
  std::vector<AdvisedStation> stations;
};

struct PlaceGuidance {
  int64_t submap_id = 0;
  uint64_t version = 0;  // of the shape
  PlaceSummary place;
  double working_distance = 0;      // submap units
  double metres_per_unit = 0;       // 0: not known
  std::vector<AgentAdvice> advice;  // of the agents that have a photo in the shape
};

// Guidance of one submap as its map snapshot (shape) changes: an update works out only what has
// changed (LivePlace), but for the viewpoints. One thread at a time.
class PlaceGuide {
 public:
  // no_go: of options.no_go. Both must outlive it. If options.altitude or no_go is given and the
  // place has no position on the earth, no viewpoints are chosen: they might lie where nobody may
  // be.
  PlaceGuide(const GuideOptions& options, const NoGoAreas& no_go);

  Result<PlaceGuidance> Update(const PlaceInput& input);

 private:
  const GuideOptions& options_;
  const NoGoAreas& no_go_;
  ShapeMap shape_map_;
  LivePlace place_;
};

}  // namespace skein
