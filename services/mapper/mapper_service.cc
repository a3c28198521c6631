#include "mapper/mapper_service.h"

#include "core/log.h"

namespace skein {
namespace {

// From saying that it takes no more work to the end: ingest hears it twice.
constexpr double kFarewellS = 2;

}  // namespace

MapperService::MapperService(Node& node, const SubmapRunOptions& options, double retire_after_s)
    : node_(node),
      options_(options),
      retire_after_s_(retire_after_s),
      worker_(node.loop()),
      writer_(node.loop()),
      idle_since_s_(node.loop().now_s()) {
  follower_ = std::make_unique<LedgerFollower>(node, 1, [this](const Fact& fact) { OnFact(fact); });
  work_ =
      std::make_unique<WorkClient>(node, "submap", 1, [this](const work_t& work) { OnWork(work); });
  shared_subscription_ = node.bus().Subscribe(
      kSharedRequestChannel, [this](const shared_request_t& request) { OnSharedRequest(request); });
  timer_ = node.loop().AddTimer(1.0, [this] {
    if (run_ != nullptr) run_->Tick();
    RetireWhenIdle();
  });
  node.OnHeartbeat([this](heartbeat_t* heartbeat) { FillHeartbeat(heartbeat); });
}

MapperService::~MapperService() {
  node_.bus().Unsubscribe(shared_subscription_);
  node_.loop().CancelTimer(timer_);
}

void MapperService::OnFact(const Fact& fact) {
  session_.Apply(fact);
  items_.Take(fact);
  if (std::holds_alternative<registration_t>(fact) && Header(fact).author == node_.instance()) {
    ++num_done_;
  }
  if (run_ != nullptr) run_->OnFact(fact);
}

void MapperService::OnWork(const work_t& work) {
  LogInfo("submap {} in epoch {}", work.item_id, work.epoch);
  run_.reset();
  run_ = std::make_unique<SubmapRun>(
      node_, LedgerView{session_, items_, *follower_}, MapperThreads{worker_, writer_}, options_,
      Lease{work.item_id, work.epoch},
      [this](SubmapRun::EndKind kind, const std::string& reason) { OnEnd(kind, reason); });
}

// The run calls this from within itself: it is dropped once it has returned.
void MapperService::OnEnd(SubmapRun::EndKind kind, const std::string& reason) {
  const int64_t submap_id = run_->submap_id();
  const int64_t epoch = run_->epoch();
  LogInfo("submap {} in epoch {} is over here: {}", submap_id, epoch, reason);
  node_.loop().Post([this, kind, reason, submap_id, epoch] {
    if (run_ == nullptr || run_->submap_id() != submap_id || run_->epoch() != epoch) return;
    run_.reset();
    if (kind == SubmapRun::EndKind::kFailed) {
      work_->Fail(submap_id, reason, false);
    } else {
      work_->Done(submap_id);
    }
  });
}

// Leaves in two steps, so that no submap is granted to a mapper that is gone.
void MapperService::RetireWhenIdle() {
  if (retire_after_s_ <= 0) return;
  const double now_s = node_.loop().now_s();
  if (run_ != nullptr || work_->num_held() > 0) idle_since_s_ = now_s;
  if (now_s - idle_since_s_ < retire_after_s_) return;
  work_->SetCapacity(0);
  if (now_s - idle_since_s_ < retire_after_s_ + kFarewellS) return;
  LogInfo("retires: no submap for {} s", retire_after_s_);
  node_.Stop();
}

void MapperService::OnSharedRequest(const shared_request_t& request) {
  if (run_ != nullptr && run_->submap_id() == request.submap_id) run_->Answer(request);
}

void MapperService::FillHeartbeat(heartbeat_t* heartbeat) const {
  heartbeat->num_done = num_done_;
  heartbeat->ledger_seq = follower_->processed_seq();
  if (run_ == nullptr) {
    heartbeat->state = work_->capacity() > 0 ? "idle" : "retiring";
    return;
  }
  heartbeat->state = "submap " + std::to_string(run_->submap_id()) + ", " +
                     std::to_string(run_->num_images()) + " photos";
  heartbeat->backlog = run_->backlog();
}

}  // namespace skein
