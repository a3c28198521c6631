#include "mapper/mapper_service.h"

#include "core/attempt.h"
#include "core/counted.h"
#include "core/log.h"
#include "session/submap_steps.h"

namespace skein {
namespace {

// From saying that it takes no more work to the end: ingest hears it twice.
constexpr double kFarewellS = 2;
constexpr double kCapacityPeriodS = 0.1;

}  // namespace

MapperService::MapperService(Node& node, const SubmapRunOptions& options, double retire_after_s,
                             double share_after_s)
    : node_(node),
      options_(options),
      retire_after_s_(retire_after_s),
      worker_(node.loop()),
      writer_(node.loop()),
      shapes_(node),
      sharing_(kMaxSubmaps, share_after_s),
      idle_since_s_(node.loop().now_s()) {
  follower_ = std::make_unique<LedgerFollower>(node, 1, [this](const Fact& fact) { OnFact(fact); });
  work_ =
      std::make_unique<WorkClient>(node, "submap", 1, [this](const work_t& work) { OnWork(work); });
  Bus& bus = node.bus();
  PollLoop& loop = node.loop();
  subscriptions_ = {
      bus.Subscribe(kSharedRequestChannel,
                    [this](const shared_request_t& request) { OnSharedRequest(request); }),
      bus.Subscribe(
          kDemandChannel,
          [this, &loop](const demand_t& demand) { sharing_.OnDemand(demand, loop.now_s()); }),
      bus.Subscribe(kWorkRequestChannel, [this, &loop](const work_request_t& request) {
        sharing_.OnRequest(request, loop.now_s());
      })};
  timers_ = {loop.AddTimer(1.0,
                           [this] {
                             ForEachRun([](SubmapRun& run) { run.Tick(); });
                             RetireWhenIdle();
                           }),
             loop.AddTimer(kCapacityPeriodS, [this] { UpdateCapacity(); })};
  node.OnHeartbeat([this](heartbeat_t* heartbeat) { FillHeartbeat(heartbeat); });
}

MapperService::~MapperService() {
  for (const auto id : subscriptions_) node_.bus().Unsubscribe(id);
  for (const auto id : timers_) node_.loop().CancelTimer(id);
}

void MapperService::OnFact(const Fact& fact) {
  session_.Apply(fact);
  items_.Take(fact);
  if (std::holds_alternative<registration_t>(fact) && Header(fact).author == node_.instance()) {
    ++num_done_;
  }
  ForEachRun([&](SubmapRun& run) { run.OnFact(fact); });
}

// work(run) of each. The run of an exception is half changed, and is dropped.
template <class Work>
void MapperService::ForEachRun(const Work& work) {
  for (const auto& [id, run] : runs_) {
    const Status done = Attempt([&work, &run = *run] { work(run); });
    if (!done.ok()) OnEnd({id, run->epoch()}, {TrialsStep(), done.error()});
  }
}

void MapperService::OnWork(const work_t& work) {
  const Lease lease{work.item_id, work.epoch};
  LogInfo("submap {} in epoch {}", lease.submap_id, lease.epoch);
  sharing_.OnTaken();
  runs_.erase(lease.submap_id);
  runs_[lease.submap_id] = std::make_unique<SubmapRun>(
      node_, LedgerView{session_, items_, *follower_},
      MapperThreads{worker_, writer_, current_, shapes_}, options_, lease,
      [this, lease](const SubmapRun::Ending& ending) { OnEnd(lease, ending); });
  UpdateCapacity();
}

// The run calls this from within itself: it is dropped once it has returned.
void MapperService::OnEnd(const Lease& lease, const SubmapRun::Ending& ending) {
  LogInfo("submap {} in epoch {} is over here: {}{}", lease.submap_id, lease.epoch,
          ending.failed_step.empty() ? "" : ending.failed_step + ": ", ending.reason);
  node_.loop().Post([this, lease, ending] {
    const auto found = runs_.find(lease.submap_id);
    if (found == runs_.end() || found->second->epoch() != lease.epoch) return;
    runs_.erase(found);
    if (ending.failed_step.empty()) {
      work_->Done(lease.submap_id);
    } else {
      work_->FailStep(lease.submap_id, ending.failed_step, ending.reason);
    }
  });
}

void MapperService::UpdateCapacity() {
  work_->SetCurrent(current_);
  if (retiring_) return work_->SetCapacity(0);
  const int num_held = work_->num_held();
  const bool offers = sharing_.Offers({num_held, NumPhotos()}, node_.loop().now_s());
  work_->SetCapacity(offers ? num_held + 1 : 1);
}

// Leaves in two steps, so that no submap is granted to a mapper that is gone.
void MapperService::RetireWhenIdle() {
  if (retire_after_s_ <= 0) return;
  const double now_s = node_.loop().now_s();
  if (!runs_.empty() || work_->num_held() > 0) idle_since_s_ = now_s;
  retiring_ = now_s - idle_since_s_ >= retire_after_s_;
  UpdateCapacity();
  if (now_s - idle_since_s_ < retire_after_s_ + kFarewellS) return;
  LogInfo("retires: no submap for {} s", retire_after_s_);
  node_.Stop();
}

void MapperService::OnSharedRequest(const shared_request_t& request) {
  const auto found = runs_.find(request.submap_id);
  if (found != runs_.end()) found->second->Answer(request);
}

int MapperService::NumPhotos() const {
  int num_photos = 0;
  for (const auto& [id, run] : runs_) num_photos += run->num_images();
  return num_photos;
}

std::string MapperService::Describe() const {
  if (runs_.empty()) return retiring_ ? "retiring" : "idle";
  std::string ids;
  for (const auto& [id, run] : runs_) ids += (ids.empty() ? "" : " + ") + std::to_string(id);
  return "map " + ids + ", " + Counted(NumPhotos(), "photo");
}

void MapperService::FillHeartbeat(heartbeat_t* heartbeat) const {
  heartbeat->num_done = num_done_;
  heartbeat->ledger_seq = follower_->processed_seq();
  heartbeat->state = Describe();
  for (const auto& [id, run] : runs_) heartbeat->backlog += run->backlog();
}

}  // namespace skein
