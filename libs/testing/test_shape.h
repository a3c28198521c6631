// For tests: a map snapshot (shape) as a mapper publishes it, and a service that works on shapes.
#pragma once

#include <functional>
#include <string>

#include "formats/shape.h"
#include "shapes/shape_store.h"
#include "testing/test_node.h"

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

// A service's node, an ingest whose ledger has a leased submap, and its mapper, which tells the
// submap's shape whenever one is wanted.
class ShapeServiceTest : public testing::Test {
 protected:
  static constexpr char kMapper[] = "mapper-1";
  static constexpr int64_t kSubmap = 3;

  ShapeServiceTest(const std::string& service, double deadline_s)
      : deadline_s_(deadline_s), node_(TestOptions(service), loop_, bus_) {
    bus_.Subscribe(kShapeWantedChannel, [this](const shape_wanted_t&) {
      if (!told_.manifest_blob.empty()) mapper_.Publish(kSubmapShapeChannel, told_);
    });
    seed_t seed{};
    seed.submap_id = kSubmap;
    Commit(seed);
    submap_lease_t lease{};
    lease.submap_id = kSubmap;
    lease.epoch = 1;
    lease.owner = kMapper;
    Commit(lease);
  }

  template <class T>
  void Commit(T fact) {
    fact.header.fact_id = std::to_string(++num_facts_);
    ingest_.Commit(Fact(fact));
  }
  void Show(const Shape& shape) { told_ = ServeShape(mapper_, shape); }
  bool WaitFor(const std::function<bool()>& done) { return loop_.RunUntil(done, deadline_s_); }

  const double deadline_s_;
  PollLoop loop_;
  Bus bus_{"memq://", loop_};
  Node ingest_node_{TestOptions("ingest"), loop_, bus_};
  Node mapper_{TestOptions(kMapper), loop_, bus_};
  Node node_;
  MemoryIngest ingest_{ingest_node_};
  int num_facts_ = 0;
  submap_shape_t told_{};
};

}  // namespace skein
