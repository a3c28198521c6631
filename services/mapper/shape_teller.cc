#include "mapper/shape_teller.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/clock.h"
#include "core/hash.h"
#include "core/log.h"
#include "map/shape_maker.h"

namespace skein {
namespace {

constexpr double kWantedS = 5;     // after it was last heard
constexpr double kForgetS = 60;    // nobody looks: the shape is dropped
constexpr double kPeriodS = 1;     // of shapes
constexpr double kCopyShare = 50;  // a copy takes at most 1 in so many seconds

}  // namespace

ShapeDesk::ShapeDesk(Node& node)
    : loop_(node.loop()), bus_(node.bus()), maker_(node.loop()), wanted_s_(-HUGE_VAL) {
  subscription_ = bus_.Subscribe(kShapeWantedChannel,
                                 [this](const shape_wanted_t&) { wanted_s_ = loop_.now_s(); });
}

ShapeDesk::~ShapeDesk() { bus_.Unsubscribe(subscription_); }

bool ShapeDesk::IsWanted() const { return loop_.now_s() - wanted_s_ < kWantedS; }

void ShapeDesk::NoteCopy(double seconds) { due_s_ = loop_.now_s() + kCopyShare * seconds; }

ShapeTeller::ShapeTeller(Node& node, SubmapWorker& worker, ShapeDesk& desk, const Lease& lease)
    : node_(node), worker_(worker), desk_(desk), lease_(lease) {}

ShapeTeller::~ShapeTeller() { Forget(); }

void ShapeTeller::NoteChange() {
  changed_ = true;
  MakeIfDue();
}

void ShapeTeller::Tick() {
  const double now_s = node_.loop().now_s();
  if (desk_.IsWanted()) {
    wanted_s_ = now_s;
    Publish();
    MakeIfDue();
  } else if (now_s - wanted_s_ > kForgetS && !making_) {
    Forget();
  }
}

void ShapeTeller::MakeIfDue() {
  if (!changed_ || making_ || waiting_ || !desk_.IsWanted()) return;
  const double now_s = node_.loop().now_s();
  const double due_s = std::max(desk_.due_s(), made_s_ + kPeriodS);
  if (now_s >= due_s) return Make();
  waiting_ = true;
  node_.loop().AddOneShot(due_s - now_s, alive_.Guarded([this] {
    waiting_ = false;
    MakeIfDue();
  }));
}

void ShapeTeller::Make() {
  struct Copy {
    std::shared_ptr<const ShapeSource> source;
    double seconds = 0;
  };
  changed_ = false;
  making_ = true;
  made_s_ = node_.loop().now_s();
  if (maker_ == nullptr) maker_ = std::make_shared<ShapeMaker>();
  worker_.Run(
      [coloured_up_to = coloured_up_to_](Submap& submap) {
        const Timer timer;
        auto source =
            std::make_shared<const ShapeSource>(CopyForShape(submap.map(), coloured_up_to));
        return Copy{std::move(source), timer.ElapsedS()};
      },
      [this](const Copy& copy) {
        desk_.NoteCopy(copy.seconds);
        copy_s_ += copy.seconds;
        coloured_up_to_ = std::max(coloured_up_to_, copy.source->MaxId());
        desk_.maker().Run(
            [maker = maker_, source = copy.source, last = told_.manifest] {
              return maker->Update(*source, NowUs()) ? MakeBlobs(*maker, last) : Made();
            },
            alive_.Guarded([this](Made made) { OnMade(std::move(made)); }));
      });
}

// Chunks that were told before keep their blobs.
ShapeTeller::Made ShapeTeller::MakeBlobs(const ShapeMaker& maker, const ShapeManifest& last) {
  const MapShape& shape = maker.shape();
  std::map<std::pair<uint64_t, uint64_t>, const ShapeManifest::Chunk*> known;
  for (const ShapeManifest::Chunk& chunk : last.chunks) known[{chunk.id, chunk.version}] = &chunk;
  Made made;
  made.changed = true;
  made.num_points = shape.NumPoints();
  made.manifest.version = shape.version;
  made.manifest.photos = shape.photos;
  made.manifest.cameras = shape.cameras;
  for (const auto& [id, chunk] : shape.chunks) {
    const auto told = known.find({id, chunk.version});
    ShapeManifest::Chunk named{id, chunk.version, chunk.num_points, "", "", chunk.tracks->size()};
    if (told != known.end()) {
      named = *told->second;
    } else {
      named.points_blob = HashBytes(chunk.points->data(), chunk.points->size());
      named.tracks_blob = HashBytes(chunk.tracks->data(), chunk.tracks->size());
    }
    made.blobs[named.points_blob] = chunk.points;
    made.blobs[named.tracks_blob] = chunk.tracks;
    made.manifest.chunks.push_back(std::move(named));
  }
  auto bytes = std::make_shared<const Bytes>(EncodeShapeManifest(made.manifest));
  made.manifest_bytes = static_cast<int64_t>(bytes->size());
  made.manifest_blob = HashBytes(bytes->data(), bytes->size());
  made.blobs[made.manifest_blob] = std::move(bytes);
  return made;
}

void ShapeTeller::OnMade(Made made) {
  making_ = false;
  if (made.changed) {
    for (const auto& [id, blob] : made.blobs) node_.blobs().Keep(id, blob);
    for (const auto& [id, blob] : previous_) node_.blobs().Release(id);
    previous_ = std::move(told_.blobs);
    told_ = std::move(made);
    ++num_shapes_;
    Publish();
  }
  MakeIfDue();
}

void ShapeTeller::Publish() {
  if (told_.manifest_blob.empty()) return;
  submap_shape_t shape{};
  shape.submap_id = lease_.submap_id;
  shape.epoch = lease_.epoch;
  shape.owner = node_.instance();
  shape.version = static_cast<int64_t>(told_.manifest.version);
  shape.num_images = static_cast<int32_t>(told_.manifest.photos.size());
  shape.num_points = static_cast<int32_t>(told_.num_points);
  shape.manifest_blob = told_.manifest_blob;
  shape.manifest_bytes = told_.manifest_bytes;
  node_.Publish(kSubmapShapeChannel, shape);
}

void ShapeTeller::Forget() {
  if (num_shapes_ > 0) {
    LogInfo("submap {}: told {} shapes; copying the map took {:.3f} s", lease_.submap_id,
            num_shapes_, copy_s_);
  }
  num_shapes_ = 0;
  copy_s_ = 0;
  for (const Blobs* blobs : {&previous_, &told_.blobs}) {
    for (const auto& [id, blob] : *blobs) node_.blobs().Release(id);
  }
  previous_.clear();
  told_ = Made();
  maker_.reset();
  coloured_up_to_ = 0;
  changed_ = true;
}

}  // namespace skein
