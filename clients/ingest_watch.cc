#include "clients/ingest_watch.h"

#include "core/clock.h"
#include "photo/photo_name.h"

namespace skein {

std::string NoSignOfIngest(const Node& node) {
  const std::string& url = node.options().lcm_url;
  return "no sign of ingest on " + (url.empty() ? "LCM's default URL" : url) +
         "; is `skein launch` running on this session, and with this --lcm-url?";
}

IngestWatch::IngestWatch(Node& node, double silent_s)
    : node_(node),
      silent_s_(silent_s),
      heard_s_(MonotonicS()),
      subscription_(node.bus().Subscribe<heartbeat_t>(kHeartbeatChannel,
                                                      [this](const heartbeat_t& heartbeat) {
                                                        if (heartbeat.service != "ingest") return;
                                                        heard_s_ = MonotonicS();
                                                        problem_ = heartbeat.problem;
                                                      })) {}

IngestWatch::~IngestWatch() { node_.bus().Unsubscribe(subscription_); }

bool IngestWatch::is_silent() const { return MonotonicS() - heard_s_ > silent_s_; }

void IngestWatch::TellChange(const std::string& command, std::ostream& out) {
  if (problem_ != told_problem_) {
    told_problem_ = problem_;
    out << command << ": "
        << (problem_.empty() ? "ingest goes on"
                             : "ingest: " + Printable(problem_, 400) + ". Waiting")
        << std::endl;
  }
  if (is_silent() == told_silent_) return;
  told_silent_ = !told_silent_;
  out << command << ": "
      << (told_silent_ ? NoSignOfIngest(node_) + " Waiting for it" : "ingest is heard again")
      << std::endl;
}

}  // namespace skein
