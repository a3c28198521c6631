#include "transport/lcm_link.h"

#include <lcm/lcm.h>

#include <stdexcept>

namespace skein {
namespace {

// Messages that LCM queues for a channel while the loop is busy. Further ones are lost.
constexpr int kQueueCapacity = 4096;

}  // namespace

LcmLink::LcmLink(const LcmUrl& url, PollLoop& loop, OnMessage on_message)
    : loop_(loop), on_message_(std::move(on_message)), lcm_(::lcm_create(url.ToString().c_str())) {
  if (lcm_ == nullptr) {
    throw std::runtime_error("LCM cannot open " + url.ToString());
  }
}

LcmLink::~LcmLink() {
  if (fd_ >= 0) loop_.RemoveFd(fd_);
  ::lcm_destroy(lcm_);
}

void LcmLink::Subscribe(const std::string& channel) {
  if (subscriptions_.count(channel)) return;
  _lcm_subscription_t* subscription = ::lcm_subscribe(lcm_, channel.c_str(), OnRaw, this);
  if (subscription == nullptr) throw std::runtime_error("LCM cannot subscribe to " + channel);
  ::lcm_subscription_set_queue_capacity(subscription, kQueueCapacity);
  subscriptions_[channel] = subscription;
  WatchFd();
}

void LcmLink::WatchFd() {
  if (fd_ >= 0) return;
  fd_ = ::lcm_get_fileno(lcm_);
  if (fd_ < 0) throw std::runtime_error("LCM cannot receive");
  loop_.AddFd(fd_, [this] { Receive(); });
}

void LcmLink::Unsubscribe(const std::string& channel) {
  const auto found = subscriptions_.find(channel);
  if (found == subscriptions_.end()) return;
  ::lcm_unsubscribe(lcm_, found->second);
  subscriptions_.erase(found);
}

bool LcmLink::Publish(const std::string& channel, const void* data, size_t size) {
  return ::lcm_publish(lcm_, channel.c_str(), data, static_cast<unsigned int>(size)) == 0;
}

void LcmLink::OnRaw(const _lcm_recv_buf_t* buffer, const char* channel, void* self) {
  const auto* data = static_cast<const uint8_t*>(buffer->data);
  static_cast<LcmLink*>(self)->received_.emplace_back(channel,
                                                      Bytes(data, data + buffer->data_size));
}

void LcmLink::Receive() {
  // LCM is C: no exception may pass through it, so it only fills a queue.
  for (int i = 0; i<kMaxBatch&& ::lcm_handle_timeout(lcm_, 0)> 0; ++i) {
    while (!received_.empty()) {
      const auto [channel, message] = std::move(received_.front());
      received_.pop_front();
      on_message_(channel, message);
    }
  }
}

}  // namespace skein
