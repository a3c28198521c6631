#include "node/demand.h"

#include <algorithm>
#include <utility>

namespace skein {
namespace {

constexpr double kTellS = 1.0;

}  // namespace

DemandTeller::DemandTeller(Node& node, std::string kind) : node_(node), kind_(std::move(kind)) {
  timer_ = node_.loop().AddTimer(kTellS, [this] { Tell(); });
}

DemandTeller::~DemandTeller() { node_.loop().CancelTimer(timer_); }

void DemandTeller::Set(int num_waiting) {
  if (num_waiting == num_waiting_) return;
  num_waiting_ = num_waiting;
  Tell();
}

void DemandTeller::Tell() {
  demand_t demand{};
  demand.author = node_.instance();
  demand.kind = kind_;
  demand.num_waiting = num_waiting_;
  node_.Publish(kDemandChannel, demand);
}

void DemandBook::OnDemand(const demand_t& demand, double now_s) {
  if (demand.kind == kind_) demands_[demand.author] = {std::max(0, demand.num_waiting), now_s};
}

void DemandBook::OnRequest(const work_request_t& request, double now_s) {
  if (request.kind == kind_) workers_[request.worker] = {std::max(0, request.capacity), now_s};
}

int DemandBook::Sum(const HeardBy& heard, double now_s) const {
  int sum = 0;
  for (const auto& [name, entry] : heard) {
    if (now_s - entry.heard_s <= forget_s_) sum += entry.number;
  }
  return sum;
}

int DemandBook::NumShort(double now_s) const {
  return std::max(0, Sum(demands_, now_s) - Sum(workers_, now_s));
}

std::vector<std::string> DemandBook::Workers(double now_s) const {
  std::vector<std::string> names;
  for (const auto& [name, entry] : workers_) {
    if (now_s - entry.heard_s <= forget_s_) names.push_back(name);
  }
  return names;
}

}  // namespace skein
