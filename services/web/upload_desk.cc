#include "web/upload_desk.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "core/file_below.h"
#include "core/log.h"

namespace skein {
namespace {

constexpr double kLookForUploadsS = 1;
constexpr double kRestAfterFaultS = 10;
// Each has a thread that reads.
constexpr size_t kMaxPublishers = 32;

PhotoToOffer OfferOf(const WaitingUpload& upload) {
  PhotoToOffer photo;
  photo.name = upload.info.name;
  photo.read = [path = upload.path, size = static_cast<size_t>(upload.info.size_bytes)] {
    return ReadFileBelow(SessionOfUpload(path), path, size);
  };
  photo.capture_utime_us = upload.info.capture_utime_us;
  photo.has_gps = upload.info.has_gps;
  photo.latitude_deg = upload.info.latitude_deg;
  photo.longitude_deg = upload.info.longitude_deg;
  photo.altitude_m = upload.info.altitude_m;
  return photo;
}

}  // namespace

UploadDesk::UploadDesk(Node& node, UploadStore& store, IsInLedger is_in_ledger)
    : node_(node), store_(store), is_in_ledger_(std::move(is_in_ledger)) {
  timer_ = node_.loop().AddTimer(kLookForUploadsS, [this] { Look(); });
  store_.OnWhole(
      [&loop = node_.loop(), look = alive_.Guarded([this] { OfferNew(); })] { loop.Post(look); });
  OfferNew();
}

UploadDesk::~UploadDesk() {
  store_.OnWhole(nullptr);
  node_.loop().CancelTimer(timer_);
}

int UploadDesk::num_offered() const {
  size_t count = 0;
  for (const auto& [name, agent] : agents_) count += agent.offered.size();
  return static_cast<int>(count);
}

void UploadDesk::Look() {
  store_.Tick();
  RemoveKnown();
  for (auto agent = agents_.begin(); agent != agents_.end();) {
    const Publisher& publisher = *agent->second.publisher;
    store_.SetWaitReason(agent->first, publisher.wait_reason());
    agent = publisher.done() ? agents_.erase(agent) : std::next(agent);
  }
  OfferNew();
}

void UploadDesk::RemoveKnown() {
  for (auto photo = acknowledged_.begin(); photo != acknowledged_.end();) {
    const auto& [agent, blob_id] = *photo;
    const bool is_known = is_in_ledger_(blob_id);
    if (is_known) store_.Remove(agent, blob_id);
    photo = is_known ? acknowledged_.erase(photo) : std::next(photo);
  }
}

void UploadDesk::OfferNew() {
  if (node_.loop().now_s() < rest_until_s_) return;
  for (const WaitingUpload& upload : store_.Waiting()) {
    if (acknowledged_.count({upload.agent, upload.blob_id}) > 0) continue;
    const auto known = agents_.find(upload.agent);
    if (known == agents_.end() && agents_.size() >= kMaxPublishers) continue;
    Agent& agent = agents_[upload.agent];
    if (agent.publisher == nullptr) {
      PublisherOptions options;
      options.agent = upload.agent;
      agent.publisher = std::make_unique<Publisher>(
          node_, options,
          [this, name = upload.agent](const PublishedPhoto& photo) { OnPublished(name, photo); });
    }
    if (!agent.offered.insert(upload.blob_id).second) continue;
    agent.publisher->Add({OfferOf(upload)});
  }
}

void UploadDesk::OnPublished(const std::string& agent, const PublishedPhoto& photo) {
  if (photo.blob_id.empty()) {
    LogError("an uploaded photo cannot be read, it is tried again: {}", photo.reason);
    rest_until_s_ = node_.loop().now_s() + kRestAfterFaultS;
    return;
  }
  if (photo.status == image_ack_t::REFUSED) {
    LogInfo("a photo of {} was refused: {}", agent, photo.reason);
    store_.Refuse(agent, photo.blob_id, {photo.cause, photo.reason});
  } else {
    acknowledged_.insert({agent, photo.blob_id});
    RemoveKnown();
  }
  agents_.at(agent).offered.erase(photo.blob_id);
}

}  // namespace skein
