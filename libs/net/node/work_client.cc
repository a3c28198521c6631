#include "node/work_client.h"

#include <algorithm>
#include <exception>
#include <utility>

#include "core/process.h"
#include "event_loop/exit_signal.h"

namespace skein {
namespace {

constexpr double kTickS = 0.02;
constexpr double kRequestS = 1.0;
constexpr double kRepeatFailureS = 0.5;
constexpr double kForgetFailureS = 60.0;

}  // namespace

WorkClient::WorkClient(Node& node, std::string kind, int capacity, OnWork on_work)
    : node_(node),
      kind_(std::move(kind)),
      host_(HostName()),
      previous_exit_signal_(PreviousExitSignal()),
      num_exceptions_(std::uncaught_exceptions()),
      capacity_(capacity),
      on_work_(std::move(on_work)) {
  work_subscription_ = node_.bus().Subscribe<work_t>(
      kWorkChannel, [this](const work_t& work) { OnWorkMessage(work); });
  failure_subscription_ = node_.bus().Subscribe<failure_t>(
      kFailureChannel, [this](const failure_t& failure) { OnFailure(failure); });
  observer_ = node_.AddFactObserver([this](const Fact& fact) {
    if (const auto* failure = std::get_if<failure_t>(&fact)) OnFailure(*failure);
  });
  timer_ = node_.loop().AddTimer(kTickS, [this] { Tick(); });
}

WorkClient::~WorkClient() {
  if (std::uncaught_exceptions() > num_exceptions_) FailCurrent();
  GiveBack();
  if (node_.loop().interrupted()) EndProcessWithin(kLeaveS);
  node_.bus().Unsubscribe(work_subscription_);
  node_.bus().Unsubscribe(failure_subscription_);
  node_.RemoveFactObserver(observer_);
  node_.loop().CancelTimer(timer_);
}

void WorkClient::OnWorkMessage(const work_t& work) {
  if (work.worker != node_.instance() || work.kind != kind_) return;
  const auto held = held_.find(work.item_id);
  const bool is_new = held == held_.end();
  if (is_new && num_held() >= capacity_) return;
  if (!is_new && work.epoch <= held->second) return;
  failed_.erase(work.item_id);  // ingest knows of it: this is another attempt
  held_[work.item_id] = work.epoch;
  if (num_held() < capacity_) request_due_s_ = 0;
  on_work_(work);
}

void WorkClient::Done(int64_t item_id) {
  if (held_.erase(item_id) > 0) request_due_s_ = 0;
}

void WorkClient::Fail(int64_t item_id, const std::string& reason, bool permanent) {
  work_failed_t message{};
  message.item_id = item_id;
  message.reason = reason;
  message.permanent = permanent;
  Tell(std::move(message));
}

void WorkClient::FailStep(int64_t item_id, const std::string& step, const std::string& reason) {
  work_failed_t message{};
  message.item_id = item_id;
  message.step = step;
  message.reason = reason;
  Tell(std::move(message));
}

void WorkClient::Tell(work_failed_t message) {
  const auto held = held_.find(message.item_id);
  if (held == held_.end()) return;
  message.worker = node_.instance();
  message.kind = kind_;
  message.epoch = held->second;
  message.reason = ClampText(message.reason);
  held_.erase(held);
  request_due_s_ = 0;
  failed_[message.item_id] = {message, 0, node_.loop().now_s() + kForgetFailureS};
  Tick();
}

void WorkClient::OnFailure(const failure_t& failure) {
  const bool is_of_submap = failure.submap_id != 0;
  if (failure.stage == kind_) failed_.erase(is_of_submap ? failure.submap_id : failure.image_id);
}

void WorkClient::SetCurrent(int64_t item_id) {
  if (item_id == current_) return;
  current_ = item_id;
  if (num_held() > 1 && holds(item_id)) request_due_s_ = 0;
}

void WorkClient::SetCapacity(int capacity) {
  if (capacity != capacity_) request_due_s_ = 0;
  capacity_ = capacity;
}

void WorkClient::Tick() {
  const double now_s = node_.loop().now_s();
  for (auto it = failed_.begin(); it != failed_.end();) {
    Failed& failed = it->second;
    if (now_s >= failed.due_s) {
      node_.Publish(kWorkFailedChannel, failed.message);
      failed.due_s = now_s + kRepeatFailureS;
    }
    it = now_s >= failed.until_s ? failed_.erase(it) : std::next(it);
  }
  if (now_s >= request_due_s_) Request();
}

void WorkClient::Request() {
  request_due_s_ = node_.loop().now_s() + kRequestS;
  node_.Publish(kWorkRequestChannel, MakeRequest());
}

// The exception's text is not to be had while the stack unwinds. Ingest that does not hear this
// counts the next one: the process comes back to the item.
void WorkClient::FailCurrent() {
  const std::vector<int64_t> held = HeldCurrentFirst();
  if (!held.empty()) Fail(held.front(), "an exception ended the worker; its log says which", false);
}

// Ingest that does not hear this lets the leases lapse.
void WorkClient::GiveBack() {
  work_request_t request = MakeRequest();
  request.capacity = -1;
  request.held.clear();
  request.num_held = 0;
  node_.Publish(kWorkRequestChannel, request);
}

work_request_t WorkClient::MakeRequest() const {
  work_request_t request{};
  request.worker = node_.instance();
  request.host = host_;
  request.kind = kind_;
  request.capacity = std::max(0, capacity_ - num_held());
  request.previous_exit_signal = previous_exit_signal_;
  const StepRecord& steps = node_.steps();
  request.previous_life = steps.left_life();
  for (const Step& step : steps.left()) {
    request.previous_items.push_back(step.item);
    request.previous_steps.push_back(step.name);
  }
  request.num_previous = static_cast<int32_t>(request.previous_items.size());
  request.held = HeldCurrentFirst();
  request.num_held = static_cast<int32_t>(request.held.size());
  return request;
}

std::vector<int64_t> WorkClient::HeldCurrentFirst() const {
  std::vector<int64_t> ids;
  if (holds(current_)) ids.push_back(current_);
  for (const auto& [item_id, epoch] : held_) {
    if (item_id != current_) ids.push_back(item_id);
  }
  return ids;
}

}  // namespace skein
