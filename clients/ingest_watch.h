// Whether ingest is there: a command that waits for it says so.
#pragma once

#include <ostream>
#include <string>

#include "node/node.h"

namespace skein {

// Silence after which ingest counts as absent; its heartbeats come once a second.
inline constexpr double kIngestSilentS = 5;

// One sentence: ingest is not heard, where it was listened for, and what to look at.
std::string NoSignOfIngest(const Node& node);

// Hears ingest's heartbeats. Loop's thread only; the node outlives it.
class IngestWatch {
 public:
  explicit IngestWatch(Node& node, double silent_s = kIngestSilentS);
  ~IngestWatch();
  IngestWatch(const IngestWatch&) = delete;
  IngestWatch& operator=(const IngestWatch&) = delete;

  // No heartbeat for silent_s, or since the watch began.
  bool is_silent() const;
  // A line on `out` when ingest has fallen silent or tells of a problem, and one when that is over;
  // else nothing.
  // To be called once a second.
  void TellChange(const std::string& command, std::ostream& out);

 private:
  void TellProblem(const std::string& command, std::ostream& out);

  Node& node_;
  const double silent_s_;
  double heard_s_;
  bool told_silent_ = false;
  heartbeat_t heard_{};       // the last one
  std::string told_problem_;  // the sentence; "" while there is none
  Bus::SubscriptionId subscription_;
};

}  // namespace skein
