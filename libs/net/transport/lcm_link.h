// memq through LCM's own library: within one process, for tests.
#pragma once

#include <deque>
#include <map>
#include <string>
#include <utility>

#include "transport/link.h"

struct _lcm_t;
struct _lcm_recv_buf_t;
struct _lcm_subscription_t;

namespace skein {

class LcmLink : public Link {
 public:
  LcmLink(const LcmUrl& url, PollLoop& loop, OnMessage on_message);
  ~LcmLink() override;
  LcmLink(const LcmLink&) = delete;
  LcmLink& operator=(const LcmLink&) = delete;

  void Subscribe(const std::string& channel) override;
  void Unsubscribe(const std::string& channel) override;
  bool Publish(const std::string& channel, const void* data, size_t size) override;

 private:
  static void OnRaw(const _lcm_recv_buf_t* buffer, const char* channel, void* self);
  void WatchFd();
  void Receive();

  PollLoop& loop_;
  const OnMessage on_message_;
  _lcm_t* lcm_;
  int fd_ = -1;  // LCM's, once it receives
  std::map<std::string, _lcm_subscription_t*> subscriptions_;
  std::deque<std::pair<std::string, Bytes>> received_;
};

}  // namespace skein
