#pragma once

#include <optional>

#include "core/result.h"
#include "node/demand.h"

namespace skein {

struct SharingOptions {
  // Limit of one mapper, for a seed. Submaps that exist are taken beyond that limit: a finish waits
  // for them.
  int max_submaps = 8;
  double after_s = 4;  // that no mapper is idle: a pool may start one meanwhile

  Status Check() const;
};

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

  explicit SubmapSharing(const SharingOptions& options) : options_(options) {}

  void OnDemand(const demand_t& demand, double now_s);
  void OnRequest(const work_request_t& request, double now_s);
  // The mapper was given a submap.
  void OnTaken();

  // Whether a mapper with this load takes one more now. Ask several times a second.
  bool Offers(const Load& load, double now_s);

 private:
  double DelayS(int num_photos) const;

  const SharingOptions options_;
  DemandBook all_{"submap"};
  DemandBook existing_{"submap"};  // without the seeds that the merger would make
  std::optional<double> short_since_s_;
  std::optional<double> offer_until_s_;
};

}  // namespace skein
