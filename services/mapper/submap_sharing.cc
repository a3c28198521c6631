#include "mapper/submap_sharing.h"

namespace skein {
namespace {

// The instance that leases work. Its demand is submaps that exist.
constexpr char kIngest[] = "ingest";
// An offer stands so long after its demand was met: a seed has to be made, committed and granted.
constexpr double kOfferS = 5;
// With so many photos in hand a mapper waits half as long again, with very many twice as long.
constexpr double kPhotosOfHalf = 100;

}  // namespace

void SubmapSharing::OnDemand(const demand_t& demand, double now_s) {
  all_.OnDemand(demand, now_s);
  if (demand.author == kIngest) existing_.OnDemand(demand, now_s);
}

void SubmapSharing::OnRequest(const work_request_t& request, double now_s) {
  all_.OnRequest(request, now_s);
  existing_.OnRequest(request, now_s);
}

void SubmapSharing::OnTaken() {
  short_since_s_.reset();
  offer_until_s_.reset();
}

double SubmapSharing::DelayS(int num_photos) const {
  return after_s_ * (1 + num_photos / (num_photos + kPhotosOfHalf));
}

bool SubmapSharing::Offers(const Load& load, double now_s) {
  if (load.num_submaps == 0) {
    OnTaken();
    return false;
  }
  const DemandBook& book = load.num_submaps < max_submaps_ ? all_ : existing_;
  if (book.NumShort(now_s) == 0) short_since_s_.reset();
  if (book.NumShort(now_s) > 0 && !short_since_s_) short_since_s_ = now_s;
  const bool is_due = short_since_s_ && now_s - *short_since_s_ >= DelayS(load.num_photos);
  const bool goes_on = offer_until_s_ && book.NumWaiting(now_s) > 0;
  if (is_due || goes_on) offer_until_s_ = now_s + kOfferS;
  return offer_until_s_ && now_s < *offer_until_s_;
}

}  // namespace skein
