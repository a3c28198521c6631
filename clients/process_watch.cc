#include "clients/process_watch.h"

#include "core/clock.h"

namespace skein {

ProcessWatch::ProcessWatch(Node& node)
    : node_(node),
      since_s_(node.loop().now_s()),
      subscription_(node.bus().Subscribe<heartbeat_t>(
          kHeartbeatChannel, [this](const heartbeat_t& heartbeat) { OnHeartbeat(heartbeat); })) {}

ProcessWatch::~ProcessWatch() { node_.bus().Unsubscribe(subscription_); }

void ProcessWatch::OnHeartbeat(const heartbeat_t& heartbeat) {
  if (heartbeat.instance == node_.instance()) return;
  if (heartbeat.state == kEndedState) {
    processes_.erase(heartbeat.instance);
  } else {
    processes_[heartbeat.instance] = {heartbeat, node_.loop().now_s(),
                                      heartbeat.utime_us - NowUs()};
  }
}

}  // namespace skein
