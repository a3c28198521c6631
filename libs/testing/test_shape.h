// For tests: a map snapshot (shape) as a mapper publishes it.
#pragma once

#include "formats/shape.h"
#include "node/node.h"
#include "shapes/shape_store.h"

namespace skein {

// The node serves the shape's chunks and their list. The message is of epoch 1.
inline submap_shape_t ServeShape(Node& mapper, const Shape& shape) {
  ShapeManifest manifest;
  manifest.version = shape.version;
  manifest.photos = shape.photos;
  manifest.cameras = shape.cameras;
  for (const Shape::Chunk& chunk : shape.chunks) {
    manifest.chunks.push_back({chunk.id, chunk.version, chunk.num_points,
                               mapper.blobs().Serve(*chunk.points),
                               mapper.blobs().Serve(*chunk.tracks), chunk.tracks->size()});
  }
  const Bytes bytes = EncodeShapeManifest(manifest);
  submap_shape_t told{};
  told.submap_id = shape.submap_id;
  told.epoch = 1;
  told.owner = mapper.instance();
  told.version = static_cast<int64_t>(shape.version);
  told.manifest_bytes = static_cast<int64_t>(bytes.size());
  told.manifest_blob = mapper.blobs().Serve(bytes);
  return told;
}

}  // namespace skein
