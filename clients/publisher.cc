#include "clients/publisher.h"

#include <algorithm>
#include <utility>

namespace skein {
namespace {

constexpr double kTickS = 0.02;
constexpr double kFirstRepeatS = 0.3;
constexpr double kLastRepeatS = 2;

}  // namespace

Publisher::Publisher(Node& node, PublisherOptions options, OnPublished on_published)
    : node_(node),
      options_(std::move(options)),
      on_published_(std::move(on_published)),
      worker_(node.loop()) {
  ack_subscription_ = node_.bus().Subscribe<image_ack_t>(
      kImageAckChannel, [this](const image_ack_t& ack) { OnAck(ack); });
  timer_ = node_.loop().AddTimer(kTickS, [this] { Tick(); });
}

Publisher::~Publisher() {
  node_.bus().Unsubscribe(ack_subscription_);
  node_.loop().CancelTimer(timer_);
}

void Publisher::Add(std::vector<PhotoFile> photos) {
  for (PhotoFile& photo : photos) waiting_.push_back(std::move(photo));
  Tick();
}

bool Publisher::MayStart(double now_s) const {
  if (waiting_.empty() || offered_.count(waiting_.front().name) > 0) return false;
  const int window = options_.rate_hz > 0 ? options_.rate_window : options_.window;
  return static_cast<int>(offered_.size()) < window && now_s >= next_start_s_;
}

void Publisher::Tick() {
  const double now_s = node_.loop().now_s();
  while (MayStart(now_s)) Start(now_s);
  for (auto& [name, offered] : offered_) {
    if (!offered.ready || offered.due_s > now_s) continue;
    node_.Publish(kImageOfferChannel, offered.offer);
    offered.due_s = now_s + offered.interval_s;
    offered.interval_s = std::min(kLastRepeatS, 1.5 * offered.interval_s);
  }
}

void Publisher::Start(double now_s) {
  const PhotoFile photo = std::move(waiting_.front());
  waiting_.pop_front();
  offered_[photo.name] = {};
  if (options_.rate_hz > 0) {
    next_start_s_ = std::max(next_start_s_, now_s - 1 / options_.rate_hz) + 1 / options_.rate_hz;
  }
  worker_.Run(
      [path = photo.path, max_size = options_.max_size_px] { return ReadPhoto(path, max_size); },
      [this, name = photo.name](Result<Bytes> bytes) { OnRead(name, std::move(bytes)); });
}

void Publisher::OnRead(const std::string& name, Result<Bytes> bytes) {
  if (!bytes.ok()) return Finish(name, image_ack_t::REFUSED, bytes.error());
  Offered& offered = offered_.at(name);
  image_offer_t& offer = offered.offer;
  offer.agent = options_.agent;
  offer.name = name;
  offer.size_bytes = static_cast<int64_t>(bytes->size());
  offer.blob_id = node_.blobs().Offer(*std::move(bytes));
  offer.owner = node_.instance();
  offer.capture_utime_us = 0;  // EXIF has it
  offer.focal_px = options_.focal_px;
  offer.has_gps = false;
  offer.latitude_deg = offer.longitude_deg = offer.altitude_m = 0;
  offered.interval_s = kFirstRepeatS;
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
  wait_reason_.clear();
  Finish(ack.name, ack.status, ack.reason);
}

void Publisher::Finish(const std::string& name, int8_t status, const std::string& reason) {
  offered_.erase(name);
  on_published_({name, status, reason});
  Tick();
}

}  // namespace skein
