// Map snapshot (shape) in chunks, for the live view: an update makes only the chunks that have
// changed.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include "formats/shape.h"
#include "map/scene_map.h"

namespace skein {

// Points, tracks, photos and cameras of a map, from which a map snapshot (shape) is made.
struct ShapeSource {
  struct Point {
    uint64_t id = 0;  // later points have higher ids
    std::array<double, 3> xyz{};
    std::array<uint8_t, 3> rgb{};
  };

  std::vector<Point> points;         // in any order
  PointTracks tracks;                // in the order of points
  std::vector<ShapePhoto> photos;    // ascending
  std::vector<ShapeCamera> cameras;  // of the photos, ascending

  uint64_t MaxId() const;
};

// Visits all points once, and the observations of those with ids above `coloured_up_to` for their
// colour; the others are black. On the thread that owns the map.
ShapeSource CopyForShape(const SceneMap& map, uint64_t coloured_up_to);
// With the colours that the points have.
ShapeSource CopyForShape(const Reconstruction& reconstruction);
// Copies the changes since the map was copied: all photos and cameras, and the points with ids >
// `above` that photos other than `known` (ascending) see. Visits the observations of these photos
// alone.
ShapeSource CopyNewForShape(const SceneMap& map, const std::vector<ImageId>& known, uint64_t above);

struct MapShape {
  struct Chunk {
    uint64_t version = 0;
    uint32_t num_points = 0;
    std::shared_ptr<const Bytes> points;  // EncodeShapeChunk
    std::shared_ptr<const Bytes> tracks;  // EncodePointTracks
  };

  uint64_t version = 0;
  std::vector<ShapePhoto> photos;
  std::vector<ShapeCamera> cameras;
  std::map<uint64_t, Chunk> chunks;  // by id

  int64_t NumPoints() const;
};

// Points stay in the chunk of their birth. So a chunk holds what was triangulated at one time,
// which lies close together when photos come in the order of a walk. A chunk's version rises when
// one of its points came, went, or moved by more than the chunk's step in a coordinate. A track
// that grows alone changes no version. Points are in a fixed order by a hash of their ids: the
// first n of a chunk are a random sample of it.
//
// The step is a power of two, between 1/16384 and 1/8192 of the map's extent: the distance from the
// median position that nine of ten points keep. Points far outside of it have chunks of their own,
// as a chunk with a large box has a large step. One thread.
class ShapeMaker {
 public:
  static constexpr int kChunkPoints = 4096;

  explicit ShapeMaker(int chunk_points = kChunkPoints) : chunk_points_(chunk_points) {}

  // False if nothing has changed. The shape's version, and that of what has changed, is `utime_us`,
  // or above the last one. A point that was there keeps its colour.
  bool Update(const ShapeSource& source, int64_t utime_us);
  // The same of `source` with the points of `news`, which are not in it, and with the photos and
  // cameras of `news`. The points of `source` are as before when this returns.
  bool UpdateWith(const ShapeSource& news, ShapeSource* source, int64_t utime_us);

  const MapShape& shape() const { return shape_; }

 private:
  struct Known {
    uint64_t id = 0;
    std::array<double, 3> xyz{};  // when its chunk was made
    std::array<uint8_t, 3> rgb{};
    uint64_t chunk = 0;
    uint32_t index = 0;  // in the source
  };
  struct ChunkState {
    double step = 0;
    int num_points = 0;
    bool changed = false;
  };

  static std::vector<Known> ById(const ShapeSource& source);
  void Scale(const std::vector<Known>& points);
  bool IsFar(const std::array<double, 3>& xyz) const;
  void Match(std::vector<Known>* points);
  bool Dissolve(std::vector<Known>* points);
  void Assign(Known* point);
  bool MakeChanged(const ShapeSource& source, std::vector<Known>* points, uint64_t version);
  void MakeChunk(uint64_t id, const ShapeSource& source, std::vector<Known*> points,
                 uint64_t version);

  const int chunk_points_;
  MapShape shape_;
  std::vector<Known> known_;  // by id
  std::map<uint64_t, ChunkState> chunks_;
  uint64_t next_chunk_ = 1;
  uint64_t open_near_ = 0, open_far_ = 0;  // take new points; 0: none
  std::array<double, 3> centre_{};
  double extent_ = 0;
  double step_ = 0;
};

}  // namespace skein
