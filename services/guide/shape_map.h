// Converts a submap's map snapshot (Shape) into the GuidedMap of libs/state/guidance.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "core/result.h"
#include "guidance/guided_map.h"
#include "shapes/shape_store.h"

namespace skein {

// Points with the photos that see them, updated from successive shapes with tracks. If a shape has
// more than max_points points, a random share of each chunk is taken (map/shape_maker.h). The share
// changes only if max_points / (number of points) differs from it by more than 10 %. Invalid photos
// and points are left out: a camera without a focal length, a pose that is not finite.
//
// Photos, cameras and points keep their index from shape to shape: new photos are appended, and a
// deleted point stays as a point without photos. A point is recognised in the next shape by its
// first observation. If a photo was deleted, the map is rebuilt. Only chunks whose version changed
// are read.
class ShapeMap {
 public:
  // agent_of_image: numbers that tell agents apart; 0 for images that are not in it. Error: a chunk
  // is damaged; the map is then empty, and the next call rebuilds it.
  Status Update(const Shape& shape, const std::map<int64_t, int32_t>& agent_of_image,
                int64_t max_points);

  const GuidedMap& map() const { return map_; }
  double share() const { return share_; }  // of the shape's points that are in the map
  // `photo`: index into map().photos. nullopt: the texture is not known.
  void SetTexture(size_t photo, const std::optional<TextureFields>& texture) {
    map_.photos[photo].texture = texture;
  }

 private:
  struct Chunk {
    uint64_t version = 0;
    bool has_unknown_photos = false;                     // among its observations
    std::vector<std::pair<uint64_t, uint32_t>> indices;  // by its first observation, of each point
  };
  // A point of a chunk: its first observation, and it.
  using KeyedPoint = std::pair<uint64_t, GuidedPoint>;

  bool HasAll(const std::map<uint32_t, const ShapePhoto*>& photos) const;
  std::map<uint32_t, const ShapePhoto*> TakeCameras(const Shape& shape);
  bool TakePhotos(const Shape& shape, const std::map<int64_t, int32_t>& agent_of_image);
  bool SetShare(const Shape& shape, int64_t max_points);
  Status TakeChunks(const Shape& shape, bool all, bool has_new_photos);
  Result<std::vector<KeyedPoint>> Read(const Shape::Chunk& chunk, bool* has_unknown_photos) const;
  void Take(std::vector<KeyedPoint> points, Chunk* chunk);
  uint32_t NewIndex();
  void Remove(uint32_t index);

  GuidedMap map_;
  double share_ = 1;
  std::map<uint32_t, int32_t> cameras_;            // by id
  std::unordered_map<uint32_t, uint32_t> photos_;  // by image id
  std::map<uint64_t, Chunk> chunks_;               // by id
  std::vector<uint32_t> free_;                     // points that are none
};

}  // namespace skein
