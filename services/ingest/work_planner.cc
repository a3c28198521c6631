#include "ingest/work_planner.h"

namespace skein {

WorkPlanner::WorkPlanner(const SessionRecord& session, double lease_s, double now_s)
    : session_(session), lease_s_(lease_s) {
  for (const char* kind : {"features", "matching"}) queues_.try_emplace(kind, lease_s);
  // A mapper that lost its lease must not go on in an epoch that another may have taken over.
  queues_.try_emplace("submap", lease_s, [this](const std::string& worker, int64_t submap_id) {
    const SubmapLife* submap = session_.state.FindSubmap(submap_id);
    return submap != nullptr && submap->lease.owner == worker;
  });
  AddOpenPhotos();
  AddOpenSubmaps(now_s);
  NoteEarlierFailures();
}

void WorkPlanner::AddOpenPhotos() {
  for (const auto& [id, photo] : session_.state.photos()) {
    if (photo.features_seq == 0 && photo.failed_stage != "features") queues_.at("features").Add(id);
    const bool named = photo.candidates_seq > 0 && photo.matches_seq == 0;
    if (named && photo.failed_stage != "matching") queues_.at("matching").Add(id);
  }
}

void WorkPlanner::AddOpenSubmaps(double now_s) {
  WorkQueue& submaps = queues_.at("submap");
  for (const auto& [id, submap] : session_.state.submaps()) {
    if (submap.ended) continue;
    submaps.Add(id);
    if (submap.lease.epoch > 0) submaps.Lease(id, submap.lease.owner, now_s);
  }
}

void WorkPlanner::NoteEarlierFailures() {
  for (const auto& [seq, failure] : session_.history.all_failures()) {
    WorkQueue* queue = Find(failure.stage);
    if (queue != nullptr && failure.image_id != 0) {
      queue->NoteEarlier(failure.image_id, failure.attempts);
    }
  }
}

WorkQueue* WorkPlanner::Find(const std::string& kind) {
  const auto found = queues_.find(kind);
  return found == queues_.end() ? nullptr : &found->second;
}

void WorkPlanner::OnFact(const Fact& fact, double now_s) {
  WorkQueue& features = queues_.at("features");
  WorkQueue& matching = queues_.at("matching");
  WorkQueue& submaps = queues_.at("submap");
  if (const auto* image = std::get_if<image_t>(&fact)) {
    features.Add(image->image_id);
  } else if (const auto* done = std::get_if<features_t>(&fact)) {
    features.Remove(done->image_id);
  } else if (const auto* candidates = std::get_if<candidates_t>(&fact)) {
    matching.Add(candidates->image_id);
  } else if (const auto* matches = std::get_if<matches_t>(&fact)) {
    matching.Remove(matches->image_id);
  } else if (const auto* seed = std::get_if<seed_t>(&fact)) {
    submaps.Add(seed->submap_id);
  } else if (const auto* lease = std::get_if<submap_lease_t>(&fact)) {
    submaps.Lease(lease->submap_id, lease->owner, now_s);
  } else if (const auto* end = std::get_if<submap_end_t>(&fact)) {
    submaps.Remove(end->submap_id);
  } else if (const auto* failure = std::get_if<failure_t>(&fact)) {
    WorkQueue* queue = Find(failure->stage);
    if (queue == nullptr || failure->image_id == 0) return;
    failure->parked ? queue->Remove(failure->image_id)
                    : queue->NoteEarlier(failure->image_id, failure->attempts);
  }
}

std::vector<WorkPlanner::Failure> WorkPlanner::OnRequest(const std::string& kind,
                                                         const WorkQueue::Request& request,
                                                         double now_s) {
  WorkQueue* queue = Find(kind);
  std::vector<Failure> failures;
  if (queue == nullptr) return failures;
  for (auto& failure : queue->OnRequest(request, now_s)) failures.push_back({kind, failure});
  return failures;
}

std::vector<WorkPlanner::Failure> WorkPlanner::OnFailed(const std::string& kind,
                                                        const std::string& worker, int64_t item,
                                                        const std::string& reason, bool permanent,
                                                        double now_s) {
  WorkQueue* queue = Find(kind);
  std::vector<Failure> failures;
  if (queue == nullptr) return failures;
  for (auto& failure : queue->OnFailed(worker, item, reason, permanent, now_s)) {
    failures.push_back({kind, failure});
  }
  return failures;
}

void WorkPlanner::Return(const std::string& kind, const std::string& worker, int64_t item,
                         double now_s) {
  if (WorkQueue* queue = Find(kind)) queue->Return(worker, item, now_s);
}

std::vector<WorkPlanner::Grant> WorkPlanner::Assign(double now_s) {
  std::vector<Grant> grants;
  for (auto& [kind, queue] : queues_) {
    for (const auto& grant : queue.Assign(now_s)) {
      grants.push_back({kind, grant.worker, grant.item, grant.attempt, grant.is_new});
    }
  }
  return grants;
}

size_t WorkPlanner::NumWaiting(const std::string& kind) const {
  const auto found = queues_.find(kind);
  return found == queues_.end() ? 0 : found->second.num_waiting();
}

}  // namespace skein
