#include "shapes/dense_follower.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "core/attempt.h"
#include "core/clock.h"
#include "core/log.h"

namespace skein {
namespace {

constexpr double kDenseStalledS = 10;
constexpr int64_t kMaxDenseManifestBytes = 64 << 20;

}  // namespace

DenseFollower::DenseFollower(Node& node, DenseStore& store, IsLive is_live, OnPoints on_points)
    : node_(node), store_(store), is_live_(std::move(is_live)), on_points_(std::move(on_points)) {
  subscription_ = node_.bus().Subscribe(
      kDensePointsChannel, [this](const dense_points_t& message) { OnMessage(message); });
}

DenseFollower::~DenseFollower() {
  node_.bus().Unsubscribe(subscription_);
  for (const auto& [id, pull] : pulls_) node_.blobs().Cancel(pull.fetch);
}

// The last one counts, as a publisher whose clock was put back has lower versions. A late datagram
// does no harm for longer than 5 s: the newest is published again.
void DenseFollower::OnMessage(const dense_points_t& message) {
  const int64_t id = message.submap_id;
  const DensePointsPtr known = store_.Find(id);
  const bool is_known = known != nullptr && known->manifest_blob == message.manifest_blob;
  if (is_known || !is_live_(id)) return;
  if (message.manifest_bytes < 0 || message.manifest_bytes > kMaxDenseManifestBytes) {
    return LogWarn("submap {}: a list of dense points of {} bytes is not taken", id,
                   message.manifest_bytes);
  }
  if (const auto pull = pulls_.find(id); pull != pulls_.end()) {
    if (!IsStalled(&pull->second)) return;
    Drop(id);
  }
  BlobClient::FetchOptions options;
  options.max_bytes = kMaxDenseManifestBytes;
  options.size_bytes = message.manifest_bytes;
  Pull& pull = pulls_[id];
  pull.progress_s = node_.loop().now_s();
  pull.fetch = node_.blobs().Fetch(
      message.manifest_blob, message.author,
      alive_.Guarded([this, message](const Result<Bytes>& bytes) { OnManifest(message, bytes); }),
      options);
}

bool DenseFollower::IsStalled(Pull* pull) const {
  const double now_s = node_.loop().now_s();
  const int64_t received = node_.blobs().ReceivedBytes(pull->fetch);
  if (received > pull->received_bytes) pull->progress_s = now_s;
  pull->received_bytes = received;
  return now_s - pull->progress_s > kDenseStalledS;
}

void DenseFollower::Drop(int64_t submap_id) {
  const auto pull = pulls_.find(submap_id);
  if (pull == pulls_.end()) return;
  node_.blobs().Cancel(pull->second.fetch);
  pulls_.erase(pull);
}

void DenseFollower::OnManifest(const dense_points_t& message, const Result<Bytes>& bytes) {
  pulls_.erase(message.submap_id);
  if (!is_live_(message.submap_id)) return;
  Status status = bytes.ok() ? Status::Ok() : bytes.status();
  if (status.ok()) {
    Result<DenseManifest> manifest = Attempt([&] { return DecodeDenseManifest(*bytes); });
    if (manifest.ok() && manifest->version == static_cast<uint64_t>(message.version)) {
      last_version_ = std::max(static_cast<uint64_t>(NowUs()), last_version_ + 1);
      const auto points = std::make_shared<const DensePoints>(
          DensePoints{message.author, message.manifest_blob, last_version_, *std::move(manifest)});
      store_.Set(message.submap_id, points);
      return on_points_(message.submap_id, *points);
    }
    status = manifest.ok() ? DataLoss("of another version") : manifest.status();
  }
  LogWarn("submap {}: its list of dense points: {}", message.submap_id, status.error());
}

}  // namespace skein
