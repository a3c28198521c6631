#pragma once

#include "core/clock.h"
#include "ingest/ledger_writer.h"
#include "ingest/work_planner.h"
#include "node/demand.h"
#include "node/node.h"

namespace skein {

// Between workers and the planner: turns requests into grants and grants into messages, and commits
// failures. A submap's new lease is committed before its mapper learns of it. Loop's thread only.
class WorkDesk {
 public:
  // Takes up all facts that are durable now, and those committed later. By `listened` workers are
  // silent, and whatever else is due.
  WorkDesk(Node& node, LedgerWriter& writer, Clock listened);

  void OnRequest(const work_request_t& request);
  void OnFailed(const work_failed_t& failed);
  // Leases waiting items to workers with free capacity; several times a second.
  void Tick();

  const WorkPlanner& planner() const { return planner_; }
  // Whether a mapper is idle.
  bool HasIdleMapper() const { return listened_() - idle_mapper_s_ < planner_.lease_s(); }

 private:
  // Failures of a submap's steps are counted in the ledger: no restart forgets them.
  bool NoteDeath(const work_request_t& request);
  void NoteFailedStep(int64_t submap_id, const std::string& step, const std::string& cause,
                      const std::string& reason);
  void CommitFailures(const std::vector<WorkPlanner::Failure>& failures);
  void EndSubmap(int64_t submap_id, const std::string& reason);
  void LeaseSubmap(const WorkPlanner::Grant& grant);
  void Send(const WorkPlanner::Grant& grant, int64_t epoch);

  Node& node_;
  LedgerWriter& writer_;
  const Clock listened_;
  WorkPlanner planner_;
  DemandTeller mappers_wanted_;
  double idle_mapper_s_ = -1e9;
};

}  // namespace skein
