#include "node/publisher.h"

#include <algorithm>
#include <utility>

#include "core/attempt.h"
#include "core/hash.h"

namespace skein {
namespace {

constexpr size_t kWindow = 4;       // photos offered at a time without a rate
constexpr size_t kRateWindow = 32;  // the same with a rate: a backlog is limited, too

constexpr double kOfferTickS = 0.02;
constexpr double kFirstOfferRepeatS = 0.3;
constexpr double kLastOfferRepeatS = 2;

Result<LoadedPhoto> Loaded(Result<Bytes> bytes) {
  if (!bytes.ok()) return bytes.status();
  const std::string blob_id = HashBytes(bytes->data(), bytes->size());
  return LoadedPhoto{blob_id, std::make_shared<const Bytes>(*std::move(bytes))};
}

}  // namespace

Publisher::Publisher(Node& node, PublisherOptions options, OnPublished on_published)
    : node_(node),
      options_(std::move(options)),
      on_published_(std::move(on_published)),
      worker_(node.loop()) {
  ack_subscription_ = node_.bus().Subscribe<image_ack_t>(
      kImageAckChannel, [this](const image_ack_t& ack) { OnAck(ack); });
  timer_ = node_.loop().AddTimer(kOfferTickS, [this] { Tick(); });
}

Publisher::~Publisher() {
  node_.bus().Unsubscribe(ack_subscription_);
  node_.loop().CancelTimer(timer_);
}

void Publisher::Add(std::vector<PhotoToOffer> photos) {
  for (PhotoToOffer& photo : photos) waiting_.push_back(std::move(photo));
  Tick();
}

bool Publisher::MayStart(double now_s) const {
  if (waiting_.empty() || offered_.count(waiting_.front().name) > 0) return false;
  const size_t window = options_.rate_hz > 0 ? kRateWindow : kWindow;
  return offered_.size() < window && now_s >= next_start_s_;
}

void Publisher::Tick() {
  const double now_s = node_.loop().now_s();
  while (MayStart(now_s)) Start(now_s);
  for (auto& [name, offered] : offered_) {
    if (!offered.ready || offered.due_s > now_s) continue;
    node_.Publish(kImageOfferChannel, offered.offer);
    offered.due_s = now_s + offered.interval_s;
    offered.interval_s = std::min(kLastOfferRepeatS, 1.5 * offered.interval_s);
  }
}

void Publisher::Start(double now_s) {
  const PhotoToOffer photo = std::move(waiting_.front());
  waiting_.pop_front();
  image_offer_t& offer = offered_[photo.name].offer;
  offer.agent = options_.agent;
  offer.name = photo.name;
  offer.owner = node_.instance();
  offer.capture_utime_us = photo.capture_utime_us;
  offer.focal_px = options_.focal_px;
  offer.has_gps = photo.has_gps;
  offer.latitude_deg = photo.latitude_deg;
  offer.longitude_deg = photo.longitude_deg;
  offer.has_altitude = photo.has_gps && photo.altitude_m;
  offer.altitude_m = photo.altitude_m.value_or(0);
  if (options_.rate_hz > 0) {
    next_start_s_ = std::max(next_start_s_, now_s - 1 / options_.rate_hz) + 1 / options_.rate_hz;
  }
  worker_.Run(
      [this, read = photo.read] { return Attempt([&] { return Load(read); }); },
      [this, name = photo.name](const Result<LoadedPhoto>& loaded) { OnRead(name, loaded); });
}

// Where the session folder is shared ingest finds the blob there, and nothing moves. It is held in
// memory, too: ingest clears blobs away that wait long for their fact.
Result<LoadedPhoto> Publisher::Load(const std::function<Result<Bytes>()>& read) const {
  Result<LoadedPhoto> loaded = Loaded(read());
  if (loaded.ok() && node_.shares_folder()) node_.blobs().Offer(*loaded->bytes);
  return loaded;
}

void Publisher::OnRead(const std::string& name, const Result<LoadedPhoto>& loaded) {
  if (!loaded.ok()) {
    return Finish({name, "", image_ack_t::REFUSED, failure_t::OTHER, loaded.error()});
  }
  Offered& offered = offered_.at(name);
  offered.offer.size_bytes = static_cast<int64_t>(loaded->bytes->size());
  offered.offer.blob_id = loaded->blob_id;
  node_.blobs().Keep(loaded->blob_id, loaded->bytes);
  offered.interval_s = kFirstOfferRepeatS;
  offered.ready = true;
  Tick();
}

void Publisher::OnAck(const image_ack_t& ack) {
  if (ack.agent != options_.agent) return;
  const auto found = offered_.find(ack.name);
  if (found == offered_.end() || found->second.offer.blob_id != ack.blob_id) return;
  if (ack.status == image_ack_t::WAIT) {
    wait_reason_ = ack.reason;
    return;
  }
  node_.blobs().Release(ack.blob_id);
  if (node_.shares_folder()) node_.blobs().Release(ack.blob_id);  // held twice on a full disk
  wait_reason_.clear();
  Finish({ack.name, ack.blob_id, ack.status, ack.cause, ack.reason});
}

void Publisher::Finish(const PublishedPhoto& photo) {
  offered_.erase(photo.name);
  on_published_(photo);
  Tick();
}

}  // namespace skein
