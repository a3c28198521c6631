#include "ingest/work_desk.h"

#include <algorithm>
#include <csignal>
#include <utility>

#include "core/attempt.h"
#include "core/log.h"
#include "event_loop/exit_signal.h"
#include "event_loop/step_record.h"
#include "ledger/fact_ids.h"
#include "photo/photo_name.h"
#include "session/submap_facts.h"
#include "session/submap_steps.h"

namespace skein {
namespace {

constexpr char kSubmapKind[] = "submap";

}  // namespace

WorkDesk::WorkDesk(Node& node, LedgerWriter& writer, Clock listened)
    : node_(node),
      writer_(writer),
      listened_(std::move(listened)),
      planner_(writer.session(), kLeaseS, listened_()),
      mappers_wanted_(node, kSubmapKind) {
  writer.AddObserver([this](const Fact& fact) { planner_.OnFact(fact, listened_()); });
}

void WorkDesk::OnRequest(const work_request_t& request) {
  const double now_s = listened_();
  if (request.kind == kSubmapKind && request.capacity > 0) idle_mapper_s_ = now_s;
  // The signal frees what the dead process held. Its death counts once: against its steps if they
  // are known, else against the item.
  const int signal = NoteDeath(request) ? SIGTERM : request.previous_exit_signal;
  CommitFailures(planner_.OnRequest(
      request.kind, {request.worker, request.capacity, signal, request.held}, now_s));
  Tick();
}

// True if the process before crashed within steps of submaps.
bool WorkDesk::NoteDeath(const work_request_t& request) {
  if (request.kind != kSubmapKind || !IsCrash(request.previous_exit_signal)) return false;
  const int num_steps = std::min(request.num_previous, StepRecord::kNumSlots);
  for (int i = 0; i < num_steps; ++i) {
    NoteFailedStep(
        request.previous_items[i], request.previous_steps[i],
        "life-" + std::to_string(request.previous_life),
        "worker died of " + SignalName(request.previous_exit_signal) + " (" + request.worker + ")");
  }
  return num_steps > 0;
}

void WorkDesk::NoteFailedStep(int64_t submap_id, const std::string& step, const std::string& cause,
                              const std::string& reason) {
  const SubmapLife* submap = writer_.state().FindSubmap(submap_id);
  if (submap == nullptr || submap->ended) return;
  failure_t fact{};
  fact.submap_id = submap_id;
  fact.step = Printable(step, 60);
  fact.header.fact_id = FailedStepFactId(submap_id, fact.step, cause);
  if (writer_.history().FindFact(fact.header.fact_id) != 0) return;
  const auto before = submap->failed_steps.find(fact.step);
  fact.header.author = node_.instance();
  fact.name = "map " + std::to_string(submap_id) + ", " + fact.step;
  fact.stage = kSubmapKind;
  fact.reason = ClampText(Printable(reason, 200));
  fact.attempts = 1 + (before == submap->failed_steps.end() ? 0 : before->second.attempts);
  fact.parked = fact.attempts >= kMaxFailures;
  LogWarn("{} failed ({} so far{}): {}", fact.name, fact.attempts,
          fact.parked ? ", left out from now on" : "", fact.reason);
  writer_.Stage(fact);
  if (fact.parked && !CanBeLeftOut(fact.step)) {
    EndSubmap(submap_id, fact.step + ": " + fact.reason);
  }
}

void WorkDesk::OnFailed(const work_failed_t& failed) {
  if (failed.kind == kSubmapKind && !failed.step.empty()) {
    const SubmapLife* submap = writer_.state().FindSubmap(failed.item_id);
    if (submap == nullptr || submap->lease.owner != failed.worker ||
        submap->lease.epoch != failed.epoch) {
      return;
    }
    NoteFailedStep(failed.item_id, failed.step, "epoch-" + std::to_string(failed.epoch),
                   failed.reason + " (" + failed.worker + ")");
    return planner_.Return(failed.kind, failed.worker, failed.item_id, listened_());
  }
  CommitFailures(planner_.OnFailed(failed.kind, failed.worker, failed.item_id, failed.reason,
                                   failed.permanent, listened_()));
}

void WorkDesk::CommitFailures(const std::vector<WorkPlanner::Failure>& failures) {
  for (const auto& [kind, failure] : failures) {
    const bool is_submap = kind == kSubmapKind;
    const PhotoState* photo = is_submap ? nullptr : writer_.state().FindPhoto(failure.item);
    failure_t fact{};
    fact.header.fact_id = FailureFactId(kind, failure.item, failure.attempts);
    fact.header.author = node_.instance();
    fact.image_id = photo == nullptr ? 0 : failure.item;
    fact.submap_id = is_submap ? failure.item : 0;
    fact.agent = photo == nullptr ? "" : photo->image.agent;
    fact.name = photo == nullptr ? "map " + std::to_string(failure.item) : photo->image.name;
    fact.stage = kind;
    fact.reason = ClampText(Printable(failure.reason, 200) + " (" + failure.worker + ")");
    fact.attempts = failure.attempts;
    fact.parked = failure.parked;
    LogWarn("{} of {} failed ({} so far{}): {}", kind, fact.name, fact.attempts,
            fact.parked ? ", parked" : "", fact.reason);
    if (writer_.history().FindFact(fact.header.fact_id) == 0) writer_.Stage(fact);
    if (is_submap && failure.parked) EndSubmap(failure.item, fact.reason);
  }
}

// Its photos become orphans, which the merger may seed again.
void WorkDesk::EndSubmap(int64_t submap_id, const std::string& reason) {
  const SubmapLife* submap = writer_.state().FindSubmap(submap_id);
  if (submap == nullptr || submap->ended) return;
  submap_end_t end = MakeSubmapEnd(submap_id, submap->lease.epoch, reason);
  end.header.author = node_.instance();
  writer_.Stage(end);
}

void WorkDesk::Tick() {
  for (const WorkPlanner::Grant& grant : planner_.Assign(listened_())) {
    if (grant.kind != kSubmapKind) {
      Send(grant, 0);
    } else if (grant.is_new) {
      LeaseSubmap(grant);
    } else {
      const SubmapLife* submap = writer_.state().FindSubmap(grant.item);
      if (submap->lease.owner == grant.worker) Send(grant, submap->lease.epoch);
    }
  }
  mappers_wanted_.Set(static_cast<int>(planner_.NumWaiting(kSubmapKind)));
}

void WorkDesk::LeaseSubmap(const WorkPlanner::Grant& grant) {
  const SubmapLife* submap = writer_.state().FindSubmap(grant.item);
  if (submap == nullptr || submap->ended) return;
  submap_lease_t fact{};
  fact.submap_id = grant.item;
  fact.epoch = submap->lease.epoch + 1;
  fact.owner = grant.worker;
  fact.header.fact_id = SubmapLeaseFactId(fact.submap_id, fact.epoch);
  fact.header.author = node_.instance();
  writer_.Stage(fact, {}, [this, grant](const Fact& committed) {
    Send(grant, std::get<submap_lease_t>(committed).epoch);
  });
}

void WorkDesk::Send(const WorkPlanner::Grant& grant, int64_t epoch) {
  work_t work{};
  work.worker = grant.worker;
  work.kind = grant.kind;
  work.item_id = grant.item;
  work.epoch = epoch;
  work.attempt = grant.attempt;
  work.lease_s = static_cast<float>(planner_.lease_s());
  node_.Publish(kWorkChannel, work);
}

}  // namespace skein
