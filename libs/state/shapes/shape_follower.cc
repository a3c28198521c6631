#include "shapes/shape_follower.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "core/attempt.h"
#include "core/log.h"

namespace skein {
namespace {

constexpr double kTellS = 1;        // period of what is said to the mappers
constexpr double kLookS = 10;       // a request counts as somebody who looks for so long
constexpr double kFirstShapeS = 5;  // a mapper has so long for the first shape
constexpr double kSilentS = 10;     // then its shapes count as given up
constexpr double kStalledS = 10;    // a pull of which nothing comes is given up
constexpr int64_t kMaxManifestBytes = 64 << 20;

// With what the known shape (null: there is none) has of it.
std::shared_ptr<Shape> MakeShape(const submap_shape_t& told, const ShapeManifest& manifest,
                                 const ShapePtr& known) {
  auto shape = std::make_shared<Shape>();
  shape->submap_id = told.submap_id;
  shape->version = manifest.version;
  shape->owner = told.owner;
  shape->photos = manifest.photos;
  shape->cameras = manifest.cameras;
  for (const ShapeManifest::Chunk& chunk : manifest.chunks) {
    shape->chunks.push_back({chunk.id, chunk.version, chunk.num_points, nullptr, nullptr,
                             chunk.tracks_blob, chunk.tracks_bytes});
    const Shape::Chunk* old = known == nullptr ? nullptr : known->Find(chunk.id);
    if (old == nullptr || old->version != chunk.version) continue;
    shape->chunks.back().points = old->points;
    shape->chunks.back().tracks = old->tracks;
  }
  return shape;
}

}  // namespace

// A part of a chunk that is not here.
struct ShapeFollower::WantedBlob {
  size_t chunk = 0;  // index
  std::string blob;
  int64_t size_bytes = 0;
  bool is_tracks = false;
};

// `shape`: with the manifest's chunks. None: it is too large.
std::optional<std::vector<ShapeFollower::WantedBlob>> ShapeFollower::WantedOf(
    const ShapeManifest& manifest, const Shape& shape, bool with_tracks) {
  std::vector<WantedBlob> wanted;
  int64_t sum_bytes = 0;
  for (size_t i = 0; i < manifest.chunks.size(); ++i) {
    const ShapeManifest::Chunk& chunk = manifest.chunks[i];
    if (chunk.num_points > ShapeChunk::kMaxPoints ||
        chunk.tracks_bytes > static_cast<uint64_t>(ShapeStore::kMaxBytes)) {
      return std::nullopt;
    }
    const auto points_bytes =
        static_cast<int64_t>(kShapeChunkHeaderBytes + kShapePointBytes * chunk.num_points);
    const auto tracks_bytes = static_cast<int64_t>(chunk.tracks_bytes);
    const bool wants_points = shape.chunks[i].points == nullptr;
    const bool wants_tracks = with_tracks && shape.chunks[i].tracks == nullptr;
    if (wants_points) wanted.push_back({i, chunk.points_blob, points_bytes, false});
    if (wants_tracks) wanted.push_back({i, chunk.tracks_blob, tracks_bytes, true});
    sum_bytes += (wants_points ? points_bytes : 0) + (wants_tracks ? tracks_bytes : 0);
    if (sum_bytes > ShapeStore::kMaxBytes) return std::nullopt;
  }
  return wanted;
}

ShapeFollowerOptions FollowLiveSubmaps(const SessionState& state) {
  ShapeFollowerOptions options;
  options.read_session = [&state](const std::function<void(const SessionState&)>& read) {
    read(state);
  };
  options.is_wanted = [&state] {
    const auto& submaps = state.submaps();
    return std::any_of(submaps.begin(), submaps.end(),
                       [](const auto& submap) { return !submap.second.ended; });
  };
  options.with_tracks = true;
  return options;
}

ShapeFollower::ShapeFollower(Node& node, ShapeStore& store, ShapeFollowerOptions options)
    : node_(node), store_(store), options_(std::move(options)), looked_s_(-HUGE_VAL) {
  subscription_ = node_.bus().Subscribe(kSubmapShapeChannel,
                                        [this](const submap_shape_t& told) { OnShape(told); });
  timer_ = node_.loop().AddTimer(kTellS, [this] { Tick(); });
}

ShapeFollower::~ShapeFollower() {
  node_.bus().Unsubscribe(subscription_);
  node_.loop().CancelTimer(timer_);
}

void ShapeFollower::NoteLook() { looked_s_ = node_.loop().now_s(); }

bool ShapeFollower::IsWanted() const {
  return options_.is_wanted() || node_.loop().now_s() - looked_s_ < kLookS;
}

bool ShapeFollower::MayUseModel(int64_t submap_id) const {
  const double now_s = node_.loop().now_s();
  const std::lock_guard<std::mutex> lock(mutex_);
  if (wanted_since_s_ == 0 || now_s - wanted_since_s_ < kFirstShapeS) return false;
  const auto heard = heard_s_.find(submap_id);
  return heard == heard_s_.end() || now_s - heard->second > kSilentS;
}

void ShapeFollower::Tick() {
  WatchPulls();
  const bool wanted = IsWanted();
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!wanted) wanted_since_s_ = 0;
    if (wanted && wanted_since_s_ == 0) wanted_since_s_ = node_.loop().now_s();
  }
  if (!wanted) return;
  shape_wanted_t message{};
  message.author = node_.instance();
  node_.Publish(kShapeWantedChannel, message);
  if (options_.on_model) TellModels();
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
  std::vector<Model> models;
  options_.read_session([&](const SessionState& state) {
    for (const auto& [id, submap] : state.submaps()) {
      if (submap.ended || !submap.latest_model) continue;
      const submap_model_t& model = *submap.latest_model;
      models.push_back({id, model.model_blob, model.header.utime_us});
    }
  });
  for (const Model& model : models) {
    if (told_models_[model.submap_id] == model.blob || !MayUseModel(model.submap_id)) continue;
    const ShapePtr shape = store_.Find(model.submap_id);
    const auto version = static_cast<uint64_t>(model.utime_us);
    if (shape != nullptr && shape->version >= version) continue;
    told_models_[model.submap_id] = model.blob;
    options_.on_model(model.submap_id, version);
  }
}

// The lease tells whose word on a submap holds.
bool ShapeFollower::IsCurrent(const submap_shape_t& told) const {
  bool is_current = false;
  options_.read_session([&](const SessionState& state) {
    const SubmapLife* submap = state.FindSubmap(told.submap_id);
    is_current = submap != nullptr && !submap->ended && submap->lease.epoch == told.epoch &&
                 submap->lease.owner == told.owner;
  });
  return is_current;
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
  const Result<ShapeManifest> manifest = bytes.ok()
                                             ? Attempt([&] { return DecodeShapeManifest(*bytes); })
                                             : Result<ShapeManifest>(bytes.status());
  if (!manifest.ok()) {
    LogDebug("submap {}: shape: {}", pull->told.submap_id, manifest.error());
    pull->failed = true;
    return OnPulled(pull);
  }
  pull->shape = MakeShape(pull->told, *manifest, store_.Find(pull->told.submap_id));
  const auto wanted = WantedOf(*manifest, *pull->shape, options_.with_tracks);
  if (!wanted) {
    LogWarn("submap {}: a shape that is too large is left out", pull->told.submap_id);
    pull->failed = true;
    return OnPulled(pull);
  }
  pull->num_missing = wanted->size();
  if (wanted->empty()) return OnPulled(pull);
  for (const WantedBlob& blob : *wanted) FetchOfChunk(pull, blob);
}

void ShapeFollower::FetchOfChunk(const std::shared_ptr<Pull>& pull, const WantedBlob& wanted) {
  BlobClient::FetchOptions options;
  options.size_bytes = wanted.size_bytes;
  options.max_bytes = wanted.size_bytes;
  const auto on_bytes = [this, pull, index = wanted.chunk,
                         is_tracks = wanted.is_tracks](Result<Bytes> bytes) {
    is_tracks ? OnTracks(pull, index, std::move(bytes)) : OnPoints(pull, index, std::move(bytes));
    if (--pull->num_missing == 0) OnPulled(pull);
  };
  pull->fetches.push_back(
      node_.blobs().Fetch(wanted.blob, pull->told.owner, alive_.Guarded(on_bytes), options));
}

void ShapeFollower::OnPoints(const std::shared_ptr<Pull>& pull, size_t index, Result<Bytes> bytes) {
  Shape::Chunk& chunk = pull->shape->chunks[index];
  const Result<ShapeChunk> decoded = bytes.ok() ? Attempt([&] { return DecodeShapeChunk(*bytes); })
                                                : Result<ShapeChunk>(bytes.status());
  if (decoded.ok() && decoded->points.size() == chunk.num_points) {
    chunk.points = std::make_shared<const Bytes>(std::move(*bytes));
  } else {
    LogDebug("submap {}: chunk {}: {}", pull->told.submap_id, chunk.id, decoded.error());
    pull->failed = true;
  }
}

void ShapeFollower::OnTracks(const std::shared_ptr<Pull>& pull, size_t index, Result<Bytes> bytes) {
  Shape::Chunk& chunk = pull->shape->chunks[index];
  const Result<PointTracks> decoded = bytes.ok()
                                          ? Attempt([&] { return DecodePointTracks(*bytes); })
                                          : Result<PointTracks>(bytes.status());
  if (decoded.ok() && decoded->ends.size() == chunk.num_points) {
    chunk.tracks = std::make_shared<const Bytes>(std::move(*bytes));
  } else {
    LogDebug("submap {}: tracks of chunk {}: {}", pull->told.submap_id, chunk.id, decoded.error());
    pull->failed = true;
  }
}

void ShapeFollower::OnPulled(const std::shared_ptr<Pull>& pull) {
  const int64_t submap_id = pull->told.submap_id;
  pulls_.erase(submap_id);
  if (!pull->failed && IsCurrent(pull->told)) {
    if (store_.Set(pull->shape)) {
      options_.on_shape(submap_id, pull->shape->version);
    } else {
      LogWarn("submap {}: no room for its shape", submap_id);
    }
  }
  PullNext(submap_id);
}

}  // namespace skein
