#include "clients/ingest_watch.h"

#include <utility>

#include "core/clock.h"
#include "photo/photo_name.h"
#include "session/troubles.h"

namespace skein {

namespace {

constexpr size_t kMaxProblemWords = 400;  // bytes of a sentence of another process

}  // namespace

std::string NoSignOfIngest(const Node& node) {
  const std::string& url = node.options().lcm_url;
  return "no answer on " + (url.empty() ? "LCM's default URL" : url) + " from session " +
         Printable(node.session_id()) + "; does `skein launch` run on it, with this --lcm-url?";
}

IngestWatch::IngestWatch(Node& node, double silent_s)
    : node_(node),
      silent_s_(silent_s),
      heard_s_(MonotonicS()),
      subscription_(node.bus().Subscribe<heartbeat_t>(kHeartbeatChannel,
                                                      [this](const heartbeat_t& heartbeat) {
                                                        if (heartbeat.service != "ingest") return;
                                                        heard_s_ = MonotonicS();
                                                        heard_ = heartbeat;
                                                      })) {}

IngestWatch::~IngestWatch() { node_.bus().Unsubscribe(subscription_); }

bool IngestWatch::is_silent() const { return MonotonicS() - heard_s_ > silent_s_; }

void IngestWatch::TellChange(const std::string& command, std::ostream& out) {
  if (heard_.problem.empty() != told_problem_.empty()) TellProblem(command, out);
  if (is_silent() == told_silent_) return;
  told_silent_ = !told_silent_;
  out << command << ": "
      << (told_silent_ ? NoSignOfIngest(node_) + " Waiting for it" : "the session answers again")
      << std::endl;
}

// Once, while its figures change.
void IngestWatch::TellProblem(const std::string& command, std::ostream& out) {
  if (heard_.problem.empty()) {
    out << command << ": over: " << std::exchange(told_problem_, "") << std::endl;
    return;
  }
  const Trouble trouble = TroubleOf(heard_);
  told_problem_ = Printable(trouble.what, kMaxProblemWords);
  out << command << ": " << told_problem_ << " " << Printable(trouble.remedy, kMaxProblemWords)
      << std::endl;
}

}  // namespace skein
