#include "clients/ingest_watch.h"

#include "core/clock.h"

namespace skein {

std::string NoSignOfIngest(const Node& node) {
  const std::string& url = node.options().lcm_url;
  return "no sign of ingest on " + (url.empty() ? "LCM's default URL" : url) +
         "; is scripts/launch.sh running on this session, and with this --lcm-url?";
}

IngestWatch::IngestWatch(Node& node, double silent_s)
    : node_(node),
      silent_s_(silent_s),
      heard_s_(MonotonicS()),
      subscription_(node.bus().Subscribe<heartbeat_t>(kHeartbeatChannel,
                                                      [this](const heartbeat_t& heartbeat) {
                                                        if (heartbeat.service == "ingest")
                                                          heard_s_ = MonotonicS();
                                                      })) {}

IngestWatch::~IngestWatch() { node_.bus().Unsubscribe(subscription_); }

bool IngestWatch::is_silent() const { return MonotonicS() - heard_s_ > silent_s_; }

void IngestWatch::TellChange(const std::string& command, std::ostream& out) {
  if (is_silent() == told_silent_) return;
  told_silent_ = !told_silent_;
  out << command << ": "
      << (told_silent_ ? NoSignOfIngest(node_) + " Waiting for it" : "ingest is heard again")
      << std::endl;
}

}  // namespace skein
