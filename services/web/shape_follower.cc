#include "web/shape_follower.h"

#include <cmath>
#include <set>
#include <utility>
#include <vector>

#include "core/log.h"

namespace skein {
namespace {

constexpr double kTellS = 1;        // period of what is said to the mappers
constexpr double kLookS = 10;       // a request counts as somebody who looks for so long
constexpr double kFirstShapeS = 5;  // a mapper has so long for the first shape
constexpr double kSilentS = 10;     // then its shapes count as given up
constexpr double kStalledS = 10;    // a pull of which nothing comes is given up
constexpr int64_t kMaxManifestBytes = 64 << 20;

}  // namespace

ShapeFollower::ShapeFollower(Node& node, const SessionView& view, ShapeStore& store,
                             std::function<int()> num_viewers,
                             std::function<void(int64_t, uint64_t)> on_shape)
    : node_(node),
      view_(view),
      store_(store),
      num_viewers_(std::move(num_viewers)),
      on_shape_(std::move(on_shape)),
      looked_s_(-HUGE_VAL) {
  subscription_ = node_.bus().Subscribe(kSubmapShapeChannel,
                                        [this](const submap_shape_t& told) { OnShape(told); });
  timer_ = node_.loop().AddTimer(kTellS, [this] { Tick(); });
}

ShapeFollower::~ShapeFollower() {
  node_.bus().Unsubscribe(subscription_);
  node_.loop().CancelTimer(timer_);
}

void ShapeFollower::NoteLook() { looked_s_ = node_.loop().now_s(); }

bool ShapeFollower::IsLooking() const {
  return num_viewers_() > 0 || node_.loop().now_s() - looked_s_ < kLookS;
}

bool ShapeFollower::MayUseModel(int64_t submap_id) const {
  const double now_s = node_.loop().now_s();
  const std::lock_guard<std::mutex> lock(mutex_);
  if (looking_since_s_ == 0 || now_s - looking_since_s_ < kFirstShapeS) return false;
  const auto heard = heard_s_.find(submap_id);
  return heard == heard_s_.end() || now_s - heard->second > kSilentS;
}

void ShapeFollower::Tick() {
  WatchPulls();
  const bool looking = IsLooking();
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!looking) looking_since_s_ = 0;
    if (looking && looking_since_s_ == 0) looking_since_s_ = node_.loop().now_s();
  }
  if (!looking) return;
  shape_wanted_t wanted{};
  wanted.author = node_.instance();
  node_.Publish(kShapeWantedChannel, wanted);
  TellModels();
}

// Who owns a blob may never answer: it died, or told another size than that of its blob.
void ShapeFollower::WatchPulls() {
  const double now_s = node_.loop().now_s();
  std::vector<std::shared_ptr<Pull>> stalled;
  for (const auto& [id, pull] : pulls_) {
    int64_t progress = -static_cast<int64_t>(pull->num_missing);
    for (const auto fetch : pull->fetches) progress += node_.blobs().ReceivedBytes(fetch);
    if (progress != std::exchange(pull->progress, progress)) pull->progress_s = now_s;
    if (now_s - pull->progress_s > kStalledS) stalled.push_back(pull);
  }
  for (const std::shared_ptr<Pull>& pull : stalled) {
    LogDebug("submap {}: shape: nothing comes of it", pull->told.submap_id);
    for (const auto fetch : pull->fetches) node_.blobs().Cancel(fetch);
    pull->failed = true;
    OnPulled(pull);
  }
}

// Where no mapper tells a shape, the newest model is one.
void ShapeFollower::TellModels() {
  struct Model {
    int64_t submap_id;
    std::string blob;
    int64_t utime_us;
  };
  const std::vector<Model> models = view_.With([](const SessionRecord& session) {
    std::vector<Model> found;
    for (const auto& [id, submap] : session.state.submaps()) {
      if (submap.ended || !submap.latest_model) continue;
      const submap_model_t& model = *submap.latest_model;
      found.push_back({id, model.model_blob, model.header.utime_us});
    }
    return found;
  });
  for (const Model& model : models) {
    if (told_models_[model.submap_id] == model.blob || !MayUseModel(model.submap_id)) continue;
    const ShapePtr shape = store_.Find(model.submap_id);
    const auto version = static_cast<uint64_t>(model.utime_us);
    if (shape != nullptr && shape->version >= version) continue;
    told_models_[model.submap_id] = model.blob;
    on_shape_(model.submap_id, version);
  }
}

// The lease tells whose word on a submap holds.
bool ShapeFollower::IsCurrent(const submap_shape_t& told) const {
  return view_.With([&](const SessionRecord& session) {
    const SubmapLife* submap = session.state.FindSubmap(told.submap_id);
    return submap != nullptr && !submap->ended && submap->lease.epoch == told.epoch &&
           submap->lease.owner == told.owner;
  });
}

void ShapeFollower::OnShape(const submap_shape_t& told) {
  if (!IsCurrent(told)) return;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    heard_s_[told.submap_id] = node_.loop().now_s();
  }
  const ShapePtr known = store_.Find(told.submap_id);
  if (known != nullptr && known->version >= static_cast<uint64_t>(told.version)) return;
  newest_[told.submap_id] = told;
  PullNext(told.submap_id);
}

void ShapeFollower::PullNext(int64_t submap_id) {
  const auto newest = newest_.find(submap_id);
  if (newest == newest_.end() || pulls_.count(submap_id) > 0) return;
  const auto pull = std::make_shared<Pull>();
  pull->told = newest->second;
  pull->progress_s = node_.loop().now_s();
  newest_.erase(newest);
  pulls_[submap_id] = pull;
  BlobClient::FetchOptions options;
  options.max_bytes = kMaxManifestBytes;
  options.size_bytes = pull->told.manifest_bytes;
  pull->fetches.push_back(node_.blobs().Fetch(
      pull->told.manifest_blob, pull->told.owner,
      alive_.Guarded([this, pull](const Result<Bytes>& bytes) { OnManifest(pull, bytes); }),
      options));
}

void ShapeFollower::OnManifest(const std::shared_ptr<Pull>& pull, const Result<Bytes>& bytes) {
  const Result<ShapeManifest> manifest =
      bytes.ok() ? DecodeShapeManifest(*bytes) : Result<ShapeManifest>(bytes.status());
  if (!manifest.ok()) {
    LogDebug("submap {}: shape: {}", pull->told.submap_id, manifest.error());
    pull->failed = true;
    return OnPulled(pull);
  }
  pull->shape = std::make_shared<Shape>();
  Shape& shape = *pull->shape;
  shape.submap_id = pull->told.submap_id;
  shape.version = manifest->version;
  shape.owner = pull->told.owner;
  shape.photos = manifest->photos;
  shape.cameras = manifest->cameras;
  const ShapePtr known = store_.Find(shape.submap_id);
  std::vector<std::pair<size_t, std::string>> wanted;
  int64_t wanted_bytes = 0;
  for (const ShapeManifest::Chunk& chunk : manifest->chunks) {
    const Shape::Chunk* old = known == nullptr ? nullptr : known->Find(chunk.id);
    const bool is_here = old != nullptr && old->version == chunk.version;
    shape.chunks.push_back({chunk.id, chunk.version, chunk.num_points,
                            is_here ? old->points : nullptr, nullptr, chunk.tracks_blob,
                            chunk.tracks_bytes});
    if (is_here) continue;
    wanted.push_back({shape.chunks.size() - 1, chunk.points_blob});
    wanted_bytes += static_cast<int64_t>(kShapeChunkHeaderBytes) +
                    static_cast<int64_t>(kShapePointBytes) * chunk.num_points;
    pull->failed |= chunk.num_points > ShapeChunk::kMaxPoints;
  }
  if (pull->failed || wanted_bytes > ShapeStore::kMaxBytes) {
    LogWarn("submap {}: a shape that is too large is left out", shape.submap_id);
    pull->failed = true;
    return OnPulled(pull);
  }
  pull->num_missing = wanted.size();
  if (wanted.empty()) return OnPulled(pull);
  for (const auto& [index, blob] : wanted) {
    BlobClient::FetchOptions options;
    options.size_bytes = static_cast<int64_t>(kShapeChunkHeaderBytes +
                                              kShapePointBytes * shape.chunks[index].num_points);
    options.max_bytes = options.size_bytes;
    pull->fetches.push_back(node_.blobs().Fetch(
        blob, shape.owner, alive_.Guarded([this, pull, index = index](Result<Bytes> points) {
          OnPoints(pull, index, std::move(points));
        }),
        options));
  }
}

void ShapeFollower::OnPoints(const std::shared_ptr<Pull>& pull, size_t index, Result<Bytes> bytes) {
  Shape::Chunk& chunk = pull->shape->chunks[index];
  const Result<ShapeChunk> decoded =
      bytes.ok() ? DecodeShapeChunk(*bytes) : Result<ShapeChunk>(bytes.status());
  if (decoded.ok() && decoded->points.size() == chunk.num_points) {
    chunk.points = std::make_shared<const Bytes>(std::move(*bytes));
  } else {
    LogDebug("submap {}: chunk {}: {}", pull->told.submap_id, chunk.id, decoded.error());
    pull->failed = true;
  }
  if (--pull->num_missing == 0) OnPulled(pull);
}

void ShapeFollower::OnPulled(const std::shared_ptr<Pull>& pull) {
  const int64_t submap_id = pull->told.submap_id;
  pulls_.erase(submap_id);
  if (!pull->failed && IsCurrent(pull->told)) {
    if (store_.Set(pull->shape)) {
      on_shape_(submap_id, pull->shape->version);
    } else {
      LogWarn("submap {}: no room for its shape", submap_id);
    }
  }
  PullNext(submap_id);
}

}  // namespace skein
