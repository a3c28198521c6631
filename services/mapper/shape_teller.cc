#include "mapper/shape_teller.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/clock.h"
#include "core/hash.h"
#include "core/log.h"
#include "map/shape_maker.h"
#include "session/submap_steps.h"

namespace skein {
namespace {

constexpr double kWantedS = 5;     // after it was last heard
constexpr double kForgetS = 60;    // nobody looks: the shape is dropped
constexpr double kPeriodS = 1;     // of shapes
constexpr double kCopyShare = 50;  // a copy takes at most 1 in so many seconds
constexpr double kMakeShare = 10;  // chunks for new photos alone take at most 1 in so many seconds

}  // namespace

ShapeDesk::ShapeDesk(Node& node)
    : loop_(node.loop()), bus_(node.bus()), maker_(node.loop()), wanted_s_(-HUGE_VAL) {
  subscription_ = bus_.Subscribe(kShapeWantedChannel,
                                 [this](const shape_wanted_t&) { wanted_s_ = loop_.now_s(); });
}

ShapeDesk::~ShapeDesk() { bus_.Unsubscribe(subscription_); }

bool ShapeDesk::IsWanted() const { return loop_.now_s() - wanted_s_ < kWantedS; }

void ShapeDesk::NoteCopy(double seconds) {
  due_s_ = std::max(due_s_, loop_.now_s()) + kCopyShare * seconds;
}

ShapeTeller::ShapeTeller(Node& node, SubmapWorker& worker, ShapeDesk& desk, const Lease& lease)
    : node_(node), worker_(worker), desk_(desk), lease_(lease), look_again_s_(HUGE_VAL) {}

ShapeTeller::~ShapeTeller() { Forget(); }

void ShapeTeller::NoteChange(bool has_new_photo) {
  changed_ = true;
  has_new_photo_ |= has_new_photo;
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
  if (!changed_ || making_ || left_out_ || !desk_.IsWanted()) return;
  const double now_s = node_.loop().now_s();
  double due_s = std::max(desk_.due_s(), made_s_ + kPeriodS);
  if (now_s >= due_s) return Make(true);
  if (has_new_photo_ && copied_ != nullptr) {
    const double new_due_s = made_s_ + std::max(kPeriodS, kMakeShare * make_s_);
    if (now_s >= new_due_s) return Make(false);
    due_s = std::min(due_s, new_due_s);
  }
  LookAgainAt(due_s);
}

void ShapeTeller::LookAgainAt(double due_s) {
  if (look_again_s_ <= due_s) return;
  look_again_s_ = due_s;
  node_.loop().AddOneShot(due_s - node_.loop().now_s(), alive_.Guarded([this, due_s] {
    if (look_again_s_ == due_s) look_again_s_ = HUGE_VAL;
    MakeIfDue();
  }));
}

// `whole`: of the whole map; else of what is new since it was last copied whole.
void ShapeTeller::Make(bool whole) {
  struct Copy {
    std::shared_ptr<ShapeSource> source;
    double seconds = 0;
  };
  if (whole) changed_ = false;
  has_new_photo_ = false;
  making_ = true;
  made_s_ = node_.loop().now_s();
  if (maker_ == nullptr) maker_ = std::make_shared<ShapeMaker>();
  worker_.Run(
      ShapeStep(),
      [whole, known = copied_photos_, above = copied_up_to_](Submap& submap) {
        const Timer timer;
        auto source =
            std::make_shared<ShapeSource>(whole ? CopyForShape(submap.map(), above)
                                                : CopyNewForShape(submap.map(), known, above));
        return Copy{std::move(source), timer.ElapsedS()};
      },
      [this, whole](const Copy& copy) {
        desk_.NoteCopy(copy.seconds);
        copy_s_ += copy.seconds;
        if (whole) TakeCopy(copy.source);
        worker_.RunOn(
            desk_.maker(), kShapeSlot, ShapeStep(),
            [maker = maker_, copied = copied_, news = whole ? nullptr : copy.source,
             last = told_.manifest] {
              const Timer timer;
              const bool changed = news == nullptr
                                       ? maker->Update(*copied, NowUs())
                                       : maker->UpdateWith(*news, copied.get(), NowUs());
              Made made = changed ? MakeBlobs(*maker, last) : Made();
              made.seconds = timer.ElapsedS();
              return made;
            },
            [this](Made made) { OnMade(std::move(made)); });
      });
}

void ShapeTeller::TakeCopy(std::shared_ptr<ShapeSource> copied) {
  copied_ = std::move(copied);
  copied_photos_.clear();
  for (const ShapePhoto& photo : copied_->photos) copied_photos_.push_back(photo.image_id);
  copied_up_to_ = std::max(copied_up_to_, copied_->MaxId());
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
  make_s_ = made.seconds;
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
  copied_.reset();
  copied_photos_.clear();
  copied_up_to_ = 0;
  changed_ = true;
}

}  // namespace skein
