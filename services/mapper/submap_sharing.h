#pragma once

#include <optional>

#include "node/demand.h"

namespace skein {

// Submaps of one mapper before it takes no further seed: all run on one thread.
constexpr int kMaxSubmaps = 8;
// No mapper is idle for so long: a pool has started one within that time. Up to twice that passes
// with many photos in hand; a finish waits longer for a mapper (merger_service.cc).
constexpr double kShareAfterS = 4;

// When a mapper that holds submaps takes one more: one waits, no mapper is idle, and a pool had the
// time to start one. Mappers agree on nothing. Each waits the longer the more photos it holds; its
// offer is capacity in its requests for work, which the others hear. If a message is lost, two
// mappers may offer, and one of them for nothing. `now_s` is any monotonic time.
class SubmapSharing {
 public:
  struct Load {
    int num_submaps = 0;
    int num_photos = 0;
  };

  // A mapper with `max_submaps` takes no further seed. Submaps that exist are taken beyond that
  // limit: a finish waits for them. `after_s`: that no mapper is idle; a pool may start one
  // meanwhile.
  SubmapSharing(int max_submaps, double after_s) : max_submaps_(max_submaps), after_s_(after_s) {}

  void OnDemand(const demand_t& demand, double now_s);
  void OnRequest(const work_request_t& request, double now_s);
  // The mapper was given a submap.
  void OnTaken();

  // Whether a mapper with this load takes one more now. Ask several times a second.
  bool Offers(const Load& load, double now_s);

 private:
  double DelayS(int num_photos) const;

  const int max_submaps_;
  const double after_s_;
  DemandBook all_{"submap"};
  DemandBook existing_{"submap"};  // without the seeds that the merger would make
  std::optional<double> short_since_s_;
  std::optional<double> offer_until_s_;
};

}  // namespace skein
